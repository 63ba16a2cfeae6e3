import { describe, expect, it } from "vitest";
import { unseen } from "../src/server/api";

describe("what was looked for in vain", () => {
  it("is said without the number of attempts and without the sentence", () => {
    expect(unseen("not found in 4 attempts: a way, a wave")).toBe("not seen: a way, a wave");
    expect(unseen("'a person's walk': not found in 1 attempt: a way")).toBe("not seen: a way");
    expect(unseen("'trudges' is not known")).toBe("'trudges' is not known");
  });
});
