/** One file of a page: its script, its style and the notices stand in it, and it may load nothing. */

import { createHash } from "node:crypto";
import type { Plugin } from "vite";
import { NOTICES } from "./notices.ts";

/** Writes `name`.html alone, with everything that the bundler made of it inside. */
export function singleFile(name: string): Plugin {
  return {
    name: "single-file",
    apply: "build",
    enforce: "post",
    generateBundle: {
      order: "post",
      handler(_, bundle) {
        let [script, style, page, notices] = ["", "", "", ""];
        for (const [file, one] of Object.entries(bundle)) {
          delete bundle[file];
          if (one.type === "chunk") script += one.code;
          else if (file.endsWith(".css")) style += String(one.source);
          else if (file === NOTICES) notices = String(one.source);
          else if (file.endsWith(".html")) page = String(one.source);
          else throw new Error(`${file} cannot stand in ${name}.html`);
        }
        this.emitFile({ type: "asset", fileName: `${name}.html`, source: whole(page, script, style, notices) });
      },
    },
  };
}

/** The page with all of it inside, under a policy that lets only these texts run and nothing be fetched. */
export function whole(page: string, script: string, style: string, notices: string): string {
  const code = script.replaceAll("</script", "<\\/script").replaceAll("<!--", "<\\!--");
  const own = /<style>([\s\S]*?)<\/style>/.exec(page)?.[1] ?? "";
  const hash = (text: string) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;
  const policy = [
    "default-src 'none'",
    `script-src ${hash(code)}`,
    `style-src ${hash(own)} ${hash(style)}`,
    "img-src data: blob:",
    "connect-src data: blob:", // pictures inside of a character are fetched by such addresses
    "base-uri 'none'",
    "form-action 'none'",
  ].join("; ");
  const shown = notices.replace(/<(?=[/!])/g, "‹"); // nothing in it is markup
  return page
    .replace(/\s*<script type="module"[^>]*src=[^>]*><\/script>/, "")
    .replace(/\s*<link rel="stylesheet"[^>]*>/, "")
    .replace(
      /(<meta charset[^>]*>)/,
      (found) => `${found}\n<meta http-equiv="Content-Security-Policy" content="${policy}">`,
    )
    .replace("</head>", () => `<style>${style}</style>\n</head>`)
    .replace(
      "</body>",
      () => `<script type="text/plain" id="notices">${shown}</script>\n<script type="module">${code}</script>\n</body>`,
    );
}
