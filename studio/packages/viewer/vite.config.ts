import { defineConfig } from "vite";

import { thirdPartyNotices } from "../../notices.ts";

/** One module with everything in it, three.js too: a page needs no bundler of its own. */
export default defineConfig({
  root: import.meta.dirname,
  publicDir: false,
  plugins: [thirdPartyNotices()],
  build: {
    target: "es2022",
    minify: true,
    lib: { entry: "src/element.ts", formats: ["es"], fileName: "motionloom-viewer" },
  },
});
