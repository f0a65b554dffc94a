// Bundles each page's script into the Python package that serves it, below the folder that is said (default: the repository).
import { copyFileSync, existsSync, mkdirSync } from "node:fs";
import { build } from "esbuild";

const root = process.argv.slice(2).find((said) => !said.startsWith("--")) ?? "../../";
const pages = {
  "watch/main.ts": "services/vistel_services/renderer/out/page/watch.js",
  "studio/wrinkles/main.ts": "clients/cli/vistel_cli/studio/wrinkles/page/studio.js",
};
// They hold code of others, so they are made at set-up and not committed; only these with --console.
const made = {
  "console/main.tsx": "services/vistel_services/console/page/console.js",
  "join/main.tsx": "services/vistel_services/console/page/join.js",
  "connection/worker.ts": "services/vistel_services/console/page/connection.js",
  "sound/microphone_worklet.ts": "services/vistel_services/console/page/microphone.js",
  "sound/player_worklet.ts": "services/vistel_services/console/page/player.js",
  "join/screen_worker.ts": "services/vistel_services/console/page/screen.js",
  "studio/avatar/main.tsx": "clients/cli/vistel_cli/studio/page/avatar.js",
  "studio/calibration/main.tsx": "clients/cli/vistel_cli/studio/page/calibration.js",
  "join/camera_worker.ts": "services/vistel_services/console/page/landmarks/camera_worker.js",
};
// Only guests who show a PDF need it: it is loaded then.
if (existsSync("node_modules/pdfjs-dist")) {
  made["join/pdf.ts"] = "services/vistel_services/console/page/pdf.js";
  made["join/pdf_worker.ts"] = "services/vistel_services/console/page/pdf_worker.js";
}
const classic = ["join/camera_worker.ts"]; // what it loads knows no modules
const onlyConsole = process.argv.includes("--console");

for (const [from, to] of Object.entries(onlyConsole ? made : { ...pages, ...made })) {
  await build({
    entryPoints: [from],
    outfile: root + to,
    bundle: true,
    format: classic.includes(from) ? "iife" : "esm",
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

// Its models are in the package, and are served as they are; only with it can a guest use their camera.
const holistic = "node_modules/@mediapipe/holistic/";
const landmarks = root + "services/vistel_services/console/page/landmarks/";
const files = ["holistic.js", "holistic.binarypb", "holistic_solution_packed_assets.data", "holistic_solution_packed_assets_loader.js"];
files.push("holistic_solution_simd_wasm_bin.js", "holistic_solution_simd_wasm_bin.wasm", "pose_landmark_full.tflite");
if (existsSync(holistic)) {
  mkdirSync(landmarks, { recursive: true });
  for (const file of files) copyFileSync(holistic + file, landmarks + file);
}
