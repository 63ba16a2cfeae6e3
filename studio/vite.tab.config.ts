import { defineConfig } from "vite";

import { thirdPartyNotices } from "./notices.ts";

/** Not every host knows that .mjs is JavaScript. */
const named = {
  output: {
    assetFileNames: ({ names }: { names: string[] }) =>
      `assets/[name]-[hash]${names[0]?.endsWith(".mjs") ? ".js" : "[extname]"}`,
  },
};

/** The page that needs no server: a folder for any web space. `make tab` puts the weights beside it. */
export default defineConfig({
  root: "tab",
  base: "./",
  plugins: [thirdPartyNotices(["onnxruntime-web"])],
  resolve: { conditions: ["onnxruntime-web-use-extern-wasm", "module", "browser", "production"] },
  worker: { format: "es", rollupOptions: named },
  build: {
    outDir: "../../out/tab",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1500,
    assetsInlineLimit: 0,
    rollupOptions: named,
  },
});
