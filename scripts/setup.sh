#!/usr/bin/env bash
# Makes .venv and installs VISTEL into it; installs missing system packages where that is allowed.
set -euo pipefail
cd "$(dirname "$0")/.."

python=""
for candidate in ${PYTHON:-} python3.13 python3.12 python3.11 python3; do
  if command -v "$candidate" >/dev/null && "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    python=$candidate
    break
  fi
done
[ -n "$python" ] || { echo "setup: Python 3.11 or newer is needed (apt install python3 python3-venv), or name one: make PYTHON=/path/to/python3.12" >&2; exit 1; }

missing=()
"$python" -c 'import ensurepip, venv' 2>/dev/null || missing+=("python3-venv")
libraries=$(PATH=$PATH:/sbin:/usr/sbin ldconfig -p 2>/dev/null || true)
have() { [[ $libraries == *"$1"* ]]; }
if [ "$(uname -s)" = Linux ]; then
  have libEGL.so.1 || missing+=(libegl1)
  have libGL.so.1 || missing+=(libgl1)
  # Software GL. A machine with its own GPU driver draws without it.
  compgen -G "/usr/lib/*/dri/*_dri.so" >/dev/null || missing+=(libgl1-mesa-dri)
fi
if [ "${#missing[@]}" -gt 0 ]; then
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "setup: installing ${missing[*]}"
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
  else
    echo "setup: system packages are missing; install them and run this again: sudo apt-get install -y ${missing[*]}" >&2
    exit 1
  fi
fi

# The console's page is made beside all else, when nothing else needs the processor; nobody waits for it.
make_page() { nice -n 19 ./scripts/console_page.sh </dev/null >/dev/null 2>/dev/null & disown; }

stamp=.venv/.installed
wanted=$(cat requirements.lock pyproject.toml "$0" | sha256sum)
if [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$wanted" ]; then make_page; exit 0; fi

# What is said is kept for when something fails; meanwhile one line tells how far it is, without a terminal one every two seconds.
log=$(mktemp) first=$(mktemp)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -f "$log" "$first"' EXIT
if [ -t 1 ]; then line=$'\r%s\033[K' end=$'\n' pause=0.5; else line='%s\n' end='' pause=2; fi
count=$(grep -c '==' requirements.lock)
step() {
  "${@:2}" >>"$log" 2>&1 &
  while kill -0 $! 2>/dev/null; do
    fetched=$(grep -c '^Collecting' "$log" || true)
    there=$(find .venv/lib -maxdepth 3 -name '*.dist-info' 2>/dev/null | wc -l || true)
    printf "$line" "setup, once: $1, $fetched of up to $count packages fetched, $there installed, $SECONDS s"
    sleep "$pause"
  done
  wait $! || { printf "$end"; tail -n 20 "$log" >&2; exit 1; }
}
pip=(.venv/bin/python -m pip install --disable-pip-version-check --progress-bar off)
[ -x .venv/bin/python ] || step "making .venv" "$python" -m venv .venv
# Byte code is made of what is used, when it is first used. With the first packages, the other core compiles kernels meanwhile.
awk '/^[^ ]/ { mine = /^(llvmlite|numba|numpy|scipy)==/ } mine' requirements.lock > "$first"
step "installing" "${pip[@]}" --no-compile --no-deps --require-hashes -r "$first"
OPENBLAS_NUM_THREADS=1 .venv/bin/python -m vistel.figure.posture.warm_up >/dev/null 2>&1 &
step "installing" "${pip[@]}" --no-compile --require-hashes -r requirements.lock
step "installing" "${pip[@]}" --no-deps --no-build-isolation -e .
printf "$end"
echo "$wanted" > "$stamp"
make_page
echo "setup: ready after $SECONDS s"
