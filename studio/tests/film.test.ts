import { describe, expect, it } from "vitest";
import { filmOf } from "../src/panels/film";

describe("a film of the stage", () => {
  it("has pictures for its seconds, at the rate of its format", () => {
    expect(filmOf({ format: "mp4", size: "1080x1920" }, [1, 3.5], [0, 0])).toEqual({
      format: "mp4",
      width: 1080,
      height: 1920,
      fps: 30,
      count: 75,
    });
    expect(filmOf({ format: "gif", size: "640x360" }, [0, 2], [0, 0]).count).toBe(40);
  });

  it("is as large as the stage, in even numbers", () => {
    expect(filmOf({ format: "mp4", size: "page" }, [0, 1], [911, 409])).toMatchObject({ width: 910, height: 408 });
  });
});
