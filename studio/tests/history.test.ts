import { describe, expect, it, vi } from "vitest";
import { History } from "../src/project/history";

const add = (n: number) => (value: number) => value + n;

describe("history", () => {
  it("undoes and redoes without end", () => {
    const history = new History(0);
    for (let n = 0; n < 5000; n += 1) history.change("add", add(1));
    for (let n = 0; n < 5000; n += 1) history.undo();
    expect(history.value).toBe(0);
    expect(history.undo()).toBe(false);
    for (let n = 0; n < 5000; n += 1) history.redo();
    expect(history.value).toBe(5000);
  });

  it("takes a gesture back as one step, and the next gesture as another", () => {
    const history = new History(0);
    for (let n = 0; n < 9; n += 1) history.change("drag", add(1), { merge: "drag:1", draft: true });
    history.change("drag", add(0), { merge: "drag:1" });
    history.change("drag", add(1), { merge: "drag:2" });
    history.undo();
    expect(history.value).toBe(9);
    history.undo();
    expect(history.value).toBe(0);
  });

  it("forgets what was undone when something new is done", () => {
    const history = new History(0);
    history.change("one", add(1));
    history.undo();
    history.change("ten", add(10));
    expect(history.redo()).toBe(false);
    expect(history.value).toBe(10);
    expect(history.undoLabel).toBe("ten");
  });

  it("keeps results of a draw with the state that they belong to", () => {
    const history = new History({ words: "a", takes: 0 });
    history.amend((old) => ({ ...old, takes: 1 }));
    history.change("write", () => ({ words: "b", takes: 1 }));
    history.amend((old) => ({ ...old, takes: 2 }));
    history.undo();
    expect(history.value).toEqual({ words: "a", takes: 1 });
    history.redo();
    expect(history.value).toEqual({ words: "b", takes: 2 });
  });

  it("takes over what was done elsewhere as one step, until something is done here", () => {
    const history = new History(0);
    const listener = vi.fn();
    history.change("add", add(1));
    history.subscribe(listener);
    for (const value of [10, 20, 30]) history.follow(value, "elsewhere");
    expect(listener.mock.calls.map(([value, change]) => [value, change])).toEqual(
      [10, 20, 30].map((value) => [value, { label: "", draft: false, typed: false, elsewhere: true }]),
    );
    history.change("add", add(1));
    history.follow(40, "elsewhere");
    const seen = [];
    while (history.undo()) seen.push(history.value);
    expect(seen).toEqual([31, 30, 1, 0]);
  });

  it("tells of every change, drafts as drafts, and of a release that changed nothing more", () => {
    const history = new History(0);
    const listener = vi.fn();
    history.subscribe(listener);
    history.change("drag", add(1), { merge: "d", draft: true });
    history.change("drag", add(0), { merge: "d" });
    expect(listener.mock.calls.map(([, change]) => (change as { draft: boolean }).draft)).toEqual([true, false]);
  });

  it("has every state with what led to it, and goes to any of them", () => {
    const history = new History(0);
    for (const [label, n] of [
      ["one", 1],
      ["ten", 10],
      ["hundred", 100],
    ] as const)
      history.change(label, add(n));
    history.undo();
    const { all, now } = history.states;
    expect(all.map(({ label, value }) => [label, value])).toEqual([
      ["the beginning", 0],
      ["one", 1],
      ["ten", 11],
      ["hundred", 111],
    ]);
    expect(now).toBe(2);
    history.go(0);
    expect(history.value).toBe(0);
    history.go(3);
    expect([history.value, history.redo()]).toEqual([111, false]);
    history.go(3);
    expect(history.undoLabel).toBe("hundred");
  });

  it("begins with what was kept of it, and nobody did anything then", () => {
    const old = new History(0);
    old.change("one", add(1));
    old.change("ten", add(10));
    old.undo();
    const again = new History(old.value, old.kept);
    expect([again.undoLabel, again.redoLabel]).toEqual(["one", "ten"]);
    const labels: string[] = [];
    again.subscribe((_, change) => labels.push(change.label));
    again.begin(5, { past: [], future: [] });
    expect([again.value, again.undo(), labels]).toEqual([5, false, [""]]);
  });
});
