#!/usr/bin/env bash
# Writes requirements.lock, and deploy/requirements.lock for images, which need no tools of developers: every Python package with
# version and hashes, no download address.
set -euo pipefail
cd "$(dirname "$0")/.."
.venv/bin/python -m uv --version >/dev/null 2>&1 || .venv/bin/python -m pip install -q uv
lock() {
  .venv/bin/python -m uv pip compile pyproject.toml --universal --python-version 3.11 \
    --generate-hashes --no-annotate --no-header --no-emit-index-url --quiet --output-file "$@"
}
lock requirements.lock --extra dev "$@"
printf 'pyyaml\nsetuptools\n' | lock deploy/requirements.lock - --extra all --constraint requirements.lock
