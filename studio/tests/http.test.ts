import { describe, expect, it } from "vitest";
import { json, plainJson, plainText } from "../src/server/http";

describe("text for the server", () => {
  it.each([
    ["half an emoji that something cut", "a film \ud83d", "a film \ufffd"],
    ["the other half", "\ude00 walks", "\ufffd walks"],
    ["a whole one", "walks \ud83d\ude00 on", "walks \ud83d\ude00 on"],
    ["control characters", "a\u0007b\u009bc\u007f\0", "abc"],
    ["tabs and line ends", "a\tb\nc\r", "a\tb\nc\r"],
  ])("%s", (_, text, plain) => {
    expect(plainText(text)).toBe(plain);
    expect(JSON.parse(plainJson({ markers: [{ name: text, time: 1 }] }))).toEqual({
      markers: [{ name: plain, time: 1 }],
    });
    expect(JSON.parse(String(json("PUT", [text]).body))).toEqual([plain]);
  });
});
