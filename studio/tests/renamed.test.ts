import { describe, expect, it } from "vitest";
import { History } from "../src/project/history";
import { type Project, blankProject, renamed, segment, wordsName } from "../src/project/model";

const saying = (...texts: string[]): Project => ({ ...blankProject(), segments: texts.map((one) => segment(one, 2)) });

describe("the name of a project", () => {
  it("is its words, without the person said again, and at most 40 letters", () => {
    expect(wordsName(saying("a person jumps", "a person sits down"))).toBe("a person jumps, sits down");
    expect(wordsName(saying("a person jumps", "a child runs"))).toBe("a person jumps, a child runs");
    expect(wordsName(saying("", " "))).toBe("Untitled");
    expect(Array.from(wordsName(saying("😀".repeat(60))))).toHaveLength(40);
  });

  it("follows the words until somebody names it, and goes back with undo", () => {
    const history = new History<Project>(saying(""), undefined, renamed);
    const write = (...texts: string[]) =>
      history.change("write", (old) => ({ ...old, segments: saying(...texts).segments }));
    write("a man jumps");
    expect(history.value.name).toBe("a man jumps");
    write("a man runs");
    expect(history.value.name).toBe("a man runs");
    history.undo();
    expect(history.value.name).toBe("a man jumps");
    history.change("rename", (old) => ({ ...old, name: "Film" }));
    write("a man crawls");
    expect(history.value.name).toBe("Film");
  });
});
