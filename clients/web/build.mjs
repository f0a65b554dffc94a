// Bundles each page's script into the Python package that serves it, below the folder that is said (default: the repository).
import { build } from "esbuild";

const root = process.argv.slice(2).find((said) => !said.startsWith("--")) ?? "../../";
const pages = {
  "watch/main.ts": "services/vistel_services/renderer/out/page/watch.js",
  "studio/main.ts": "clients/cli/vistel_cli/wrinkle/studio/page/studio.js",
};
// They hold code of others, so they are made at set-up and not committed; only these with --console.
const made = {
  "console/main.tsx": "services/vistel_services/console/page/console.js",
  "join/main.tsx": "services/vistel_services/console/page/join.js",
  "connection/worker.ts": "services/vistel_services/console/page/connection.js",
  "sound/microphone_worklet.ts": "services/vistel_services/console/page/microphone.js",
  "sound/player_worklet.ts": "services/vistel_services/console/page/player.js",
};
const onlyConsole = process.argv.includes("--console");

for (const [from, to] of Object.entries(onlyConsole ? made : { ...pages, ...made })) {
  await build({
    entryPoints: [from],
    outfile: root + to,
    bundle: true,
    format: "esm",
    target: "es2022",
    charset: "utf8",
    legalComments: "inline",
    jsx: "automatic",
    jsxImportSource: "preact",
    minify: from in made,
    loader: { ".css": "text" },
    logLevel: "warning",
  });
  console.log(to);
}
