import { type Plugin, defineConfig, loadEnv } from "vite";

import { thirdPartyNotices } from "./notices.ts";

const server = loadEnv("", ".", "MOTIONLOOM_").MOTIONLOOM_SERVER ?? "http://127.0.0.1:8765";

/** Of the decoders of Draco only the one for glTF is a file of the page; the loader names two others. */
function oneDraco(): Plugin {
  return {
    name: "one-draco",
    enforce: "pre",
    transform: (code: string, id: string) =>
      /DRACOLoader\.js/.test(id)
        ? code.replaceAll(/new URL\( '\.\.\/libs\/draco\/draco[^)]*\)/g, 'new URL( "about:blank" )')
        : null,
  };
}

/** The page lies in the Python package, so that the wheel carries it; `base` is relative, so that any path serves it. */
export default defineConfig({
  base: "./",
  plugins: [oneDraco(), thirdPartyNotices()],
  build: {
    outDir: "../packages/motionloom/src/motionloom/server/page",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1500,
    assetsInlineLimit: 0,
  },
  server: {
    proxy: Object.fromEntries(
      [
        "/health",
        "/capabilities",
        "/jobs",
        "/motions",
        "/characters",
        "/project",
        "/projects",
        "/sentence.json",
        "/timeline",
      ].map((path) => [path, server]),
    ),
  },
});
