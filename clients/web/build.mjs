// Bundles each page's script into the Python package that serves it, below the folder that is said (default: the repository).
import { build } from "esbuild";

const root = process.argv[2] ?? "../../";
const pages = {
  "watch/main.ts": "services/vistel_services/renderer/out/page/watch.js",
  "studio/main.ts": "clients/cli/vistel_cli/wrinkle/studio/page/studio.js",
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
