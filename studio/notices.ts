/** Third-party notices of the page: the licence texts of every package of which a line ends in the bundle. */

import { existsSync, readdirSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import type { Plugin } from "vite";

export const NOTICES = "third-party-notices.txt";

interface Package {
  name: string;
  version: string;
  licence: string;
  text: string;
}

/** The folder of the package that a module belongs to; null for the page's own code. */
export function packageFolder(module: string): string | null {
  const path = module.replace(/\\/g, "/").split("?")[0] ?? "";
  const start = path.lastIndexOf("/node_modules/");
  if (start < 0) return null;
  const parts = path.slice(start + "/node_modules/".length).split("/");
  return path.slice(0, start) + "/node_modules/" + parts.slice(0, parts[0]?.startsWith("@") ? 2 : 1).join("/");
}

/** Name, version and licence text of a package; an Error where it brings no text, for then it may not be bundled. */
export function readPackage(folder: string): Package {
  const { name, version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8")) as Record<
    string,
    string
  >;
  const files = readdirSync(folder)
    .filter((file) => /^(licen[cs]e|notice|copying)/i.test(file))
    .sort()
    .map((file) => join(folder, file));
  const ours = join(import.meta.dirname, "licences", `${name}.txt`); // of a package that forgot its own
  if (files.length === 0 && existsSync(ours)) files.push(ours);
  if (!name || !version || !license || files.length === 0)
    throw new Error(`${folder} is bundled into the page and has no licence text; leave it out or add its text`);
  const text = files.map((file) => readFileSync(file, "utf8").trim()).join("\n\n");
  return { name, version, licence: license, text };
}

/** Works of others inside of packages, by the file that they are in; their texts lie in `licences`. */
const INSIDE: Readonly<Record<string, Omit<Package, "text">>> = {
  "meshopt_decoder.module.js": { name: "meshoptimizer", version: "in three.js", licence: "MIT" },
  "DRACOLoader.js": { name: "draco", version: "in three.js", licence: "Apache-2.0" }, // its decoder is a file beside it
};

/** What a module is, if it is somebody else's than its package; null: it is not. */
export function insidePackage(module: string): Package | null {
  const found = INSIDE[module.split(/[?]/)[0]!.split(/[\\/]/).at(-1)!];
  if (!found || !packageFolder(module)) return null;
  return { ...found, text: readFileSync(join(import.meta.dirname, "licences", `${found.name}.txt`), "utf8").trim() };
}

/** The page of notices, one package after the other. */
export function notices(packages: Package[]): string {
  const rule = "-".repeat(80);
  const head = "This page of motionloom (MIT) contains the following works of others.";
  const parts = packages.map((one) => `${rule}\n${one.name} ${one.version} (${one.licence})\n\n${one.text}`);
  return [head, ...parts].join("\n\n") + "\n";
}

/** Writes the notices beside the page, from what the bundler took, and of packages that its workers are made of. */
export function thirdPartyNotices(inWorkers: readonly string[] = []): Plugin {
  return {
    name: "third-party-notices",
    apply: "build",
    generateBundle(_, bundle) {
      const folders = new Set(inWorkers.map((name) => join(import.meta.dirname, "node_modules", name)));
      const inside = new Map<string, Package>();
      for (const chunk of Object.values(bundle)) {
        if (chunk.type !== "chunk") continue;
        for (const [id, module] of Object.entries(chunk.modules)) {
          if (module.renderedLength === 0) continue;
          const folder = id.startsWith("\0") ? bundlerFolder(id) : packageFolder(id);
          if (folder) folders.add(folder);
          const other = insidePackage(id);
          if (other) inside.set(other.name, other);
        }
      }
      const packages = [...[...folders].sort().map(readPackage), ...inside.values()];
      this.emitFile({ type: "asset", fileName: NOTICES, source: notices(packages) });
    },
  };
}

/** Where the licence of a helper lies that the bundler itself puts in, such as `\0rolldown/runtime.js`. */
function bundlerFolder(id: string): string {
  const name = id.slice(1).split("/")[0] ?? "";
  for (let folder = import.meta.dirname; folder !== dirname(folder); folder = dirname(folder)) {
    const place = join(folder, "node_modules", name);
    if (existsSync(place)) return place;
  }
  throw new Error(`the bundler put ${JSON.stringify(id)} into the page, of which no licence text is known`);
}
