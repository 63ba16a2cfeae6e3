import { defineConfig } from "vite";

import { thirdPartyNotices } from "./notices.ts";
import { singleFile } from "./single.ts";

/** The viewer is one file beside the Python that fills it (`motionloom/viz/page.py`). */
export default defineConfig({
  base: "./",
  publicDir: false,
  plugins: [thirdPartyNotices(), singleFile("viewer")],
  build: {
    outDir: "../packages/motionloom/src/motionloom/viz",
    emptyOutDir: false,
    target: "es2022",
    modulePreload: false,
    chunkSizeWarningLimit: 1500,
    rolldownOptions: { input: "viewer.html" },
  },
});
