// Bundles each page's script into the Python package that serves it.
import { build } from "esbuild";

const root = "../../";
const pages = {
  "watch/main.ts": "services/vistel_services/renderer/page/watch.js",
};

for (const [from, to] of Object.entries(pages)) {
  await build({
    entryPoints: [from],
    outfile: root + to,
    bundle: true,
    format: "esm",
    target: "es2022",
    charset: "utf8",
    legalComments: "inline",
    logLevel: "warning",
  });
  console.log(to);
}
