import { describe, expect, it } from "vitest";
import { Pending } from "../src/stage/pending";

describe("a picture that processors draw", () => {
  it("is waited for without a command that waits, and only the last one", () => {
    const there = new Map<object, boolean>();
    const commands: string[] = [];
    const gl = {
      SYNC_GPU_COMMANDS_COMPLETE: 1,
      SYNC_STATUS: 2,
      SIGNALED: 3,
      UNSIGNALED: 4,
      fenceSync: () => {
        const sync = {};
        there.set(sync, false);
        return sync;
      },
      getSyncParameter: (sync: object) => (there.get(sync) ? 3 : 4),
      deleteSync: (sync: object | null) => sync && there.delete(sync),
      flush: () => commands.push("flush"),
    };
    const pending = new Pending(gl as never);
    expect(pending.isDrawing).toBe(false);
    pending.begin();
    pending.begin();
    expect(pending.isDrawing).toBe(true);
    expect(there.size).toBe(1);
    for (const sync of there.keys()) there.set(sync, true);
    expect(pending.isDrawing).toBe(false);
    expect(there.size).toBe(0);
    expect(commands).toEqual(["flush", "flush"]);
  });
});
