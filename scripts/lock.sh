#!/usr/bin/env bash
# Writes requirements.lock: every Python package with version and hashes, no download address.
set -euo pipefail
cd "$(dirname "$0")/.."
.venv/bin/python -m uv --version >/dev/null 2>&1 || .venv/bin/python -m pip install -q uv
.venv/bin/python -m uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 \
  --generate-hashes --no-annotate --no-header --no-emit-index-url --quiet --output-file requirements.lock "$@"
