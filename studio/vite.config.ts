import { defineConfig, loadEnv } from "vite";

import { thirdPartyNotices } from "./notices.ts";

const server = loadEnv("", ".", "MOTIONLOOM_").MOTIONLOOM_SERVER ?? "http://127.0.0.1:8765";

/** The page lies in the Python package, so that the wheel carries it; `base` is relative, so that any path serves it. */
export default defineConfig({
  base: "./",
  plugins: [thirdPartyNotices()],
  build: {
    outDir: "../packages/motionloom/src/motionloom/server/page",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1500,
  },
  server: {
    proxy: Object.fromEntries(
      ["/health", "/capabilities", "/jobs", "/motions", "/characters", "/project", "/timeline"].map((path) => [
        path,
        server,
      ]),
    ),
  },
});
