#!/usr/bin/env bash
# Installs what some tests need besides VISTEL, where that is allowed. Where it is not, says what is missing; the tests that
# need it are then skipped, and each says why.
set -euo pipefail
cd "$(dirname "$0")/.."
[ "$(uname -s)" = Linux ] || exit 0

missing=()
program() { # NAME PACKAGE...
  local name=$1; shift
  command -v "$name" >/dev/null || missing+=("$@")
}
program Xvfb xvfb               # windows
program pulseaudio pulseaudio   # sound cards
program flite flite             # speech
program espeak-ng espeak-ng
program ffmpeg ffmpeg           # what is given to other programs
program glslangValidator glslang-tools
program openssl openssl
program cc gcc libc6-dev        # the kernel's headers
program etcd etcd-server        # leases of rooms
program age age                 # encrypted logs of others
command -v chromium chromium-browser google-chrome >/dev/null || missing+=(chromium)
libraries=$(PATH=$PATH:/sbin:/usr/sbin ldconfig -p 2>/dev/null || true)
[[ $libraries == *libportaudio.so.2* ]] || missing+=(libportaudio2)
compgen -G "/usr/lib/*/alsa-lib/libasound_module_pcm_pulse.so" >/dev/null || missing+=(libasound2-plugins)

if [ "${#missing[@]}" -gt 0 ]; then
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "setup: installing for tests: ${missing[*]}"
    apt-get update -qq &&
      DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null ||
      echo "setup: not all of it could be installed; tests that need what is missing are skipped" >&2
  else
    echo "setup: tests that need these are skipped: sudo apt-get install -y ${missing[*]}" >&2
  fi
fi

.venv/bin/python -c 'import kubernetes_validate' 2>/dev/null || # schemas of a cluster's objects: too large for everybody
  .venv/bin/python -m pip install --disable-pip-version-check -q kubernetes-validate==1.37.0 ||
  echo "setup: kubernetes-validate cannot be installed; its tests are skipped" >&2

.venv/bin/python -c 'import material' 2>/dev/null || # the documentation as a site
  .venv/bin/python -m pip install --disable-pip-version-check -q "$(sed -n 's/^SITE := //p' Makefile)" ||
  echo "setup: mkdocs-material cannot be installed; the tests of the site are skipped" >&2

if command -v npm >/dev/null && { [ ! -d clients/web/node_modules/typescript ] || [ ! -d clients/web/node_modules/iwer ]; }; then
  # Not while set-up makes the console's page from the same packages.
  (flock 9 && cd clients/web && npm ci --no-audit --no-fund --silent) 9<scripts/console_page.sh ||
    echo "setup: npm cannot install the packages of clients/web; its tests are skipped" >&2
fi
./scripts/console_page.sh
