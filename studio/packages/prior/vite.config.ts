import { readFileSync } from "node:fs";
import { join } from "node:path";
import { isolatedDeclarationSync } from "rolldown/experimental";
import { type Plugin, defineConfig } from "vite";

const ENTRIES = { motionloom: "src/index.ts", three: "src/three.ts" };

/** The types of each entry as one file, since none of them names a type of another module of the studio. */
function declarations(): Plugin {
  return {
    name: "declarations",
    apply: "build",
    generateBundle() {
      for (const [name, file] of Object.entries(ENTRIES)) {
        const place = join(import.meta.dirname, file);
        const { code, errors } = isolatedDeclarationSync(place, readFileSync(place, "utf8"));
        if (errors.length) throw new Error(errors.map(({ message }) => message).join("\n"));
        const found = code.replace(/"\.\/index"/g, '"./motionloom.js"');
        if (/from "\.\.\//.test(found)) throw new Error(`${file} has types of the studio in what it exports`);
        this.emitFile({ type: "asset", fileName: `${name}.d.ts`, source: found });
      }
    },
  };
}

/** The prior alone: ONNX Runtime and three.js stay packages of their own, which the user installs. */
export default defineConfig({
  root: import.meta.dirname,
  publicDir: false,
  plugins: [declarations()],
  build: {
    target: "es2022",
    minify: false,
    lib: { entry: ENTRIES, formats: ["es"] },
    rolldownOptions: {
      external: [/^onnxruntime-/, /^three/],
      treeshake: { moduleSideEffects: false },
      output: { chunkFileNames: "shared.js" },
    },
  },
});
