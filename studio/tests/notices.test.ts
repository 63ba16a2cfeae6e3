import { mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { expect, test } from "vitest";
import { insidePackage, notices, packageFolder, readPackage } from "../notices";

test("a module belongs to the innermost package of its path", () => {
  expect(packageFolder("/a/node_modules/three/build/three.core.js")).toBe("/a/node_modules/three");
  expect(packageFolder("/a/node_modules/@x/y/z.js?v=1")).toBe("/a/node_modules/@x/y");
  expect(packageFolder("C:\\a\\node_modules\\p\\node_modules\\q\\i.js")).toBe("C:/a/node_modules/p/node_modules/q");
  expect(packageFolder("/a/src/main.ts")).toBeNull();
});

test("a work of others inside of a package is shown too", () => {
  const decoder = insidePackage("/a/node_modules/three/examples/jsm/libs/meshopt_decoder.module.js");
  expect(decoder?.text).toContain("Arseny Kapoulkine");
  expect(insidePackage("/a/node_modules/three/build/three.core.js")).toBeNull();
});

test("a package is shown with its whole licence, and refused without one", () => {
  const folder = mkdtempSync(join(tmpdir(), "notices"));
  writeFileSync(join(folder, "package.json"), JSON.stringify({ name: "p", version: "1.0.0", license: "ISC" }));
  expect(() => readPackage(folder)).toThrow("no licence text");
  writeFileSync(join(folder, "LICENSE.md"), "Copyright (c) somebody\n");
  expect(notices([readPackage(folder)])).toContain("p 1.0.0 (ISC)\n\nCopyright (c) somebody\n");
});
