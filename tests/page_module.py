"""A module of the pages in node, without a browser."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

WEB = Path(__file__).resolve().parents[1] / "clients/web"
_BUILD = """
import { build } from "esbuild";
await build({ entryPoints: [process.argv[1]], bundle: true, format: "esm", outfile: process.argv[2] });
"""
_GIVEN = 'import { readFileSync } from "node:fs";\nconst given = JSON.parse(readFileSync(0, "utf-8"));\n'


def in_node(folder: Path, module: str, program: str) -> Callable[[object], Any]:
    """A function that gives a value to `program`, as `given`, and returns what it logs; both are JSON. module: of clients/web; the
    program imports it as "./module.mjs". Skips where there is no node."""
    node = shutil.which("node")
    if node is None or not (WEB / "node_modules/esbuild").is_dir():
        pytest.skip("node or clients/web/node_modules is not there (make web)")
    command = [node, "--input-type=module", "-e", _BUILD, module, str(folder / "module.mjs")]
    subprocess.run(command, cwd=WEB, check=True, capture_output=True)
    (folder / "program.mjs").write_text(_GIVEN + program)

    def run(given: object) -> Any:
        asked = json.dumps(given)
        ran = subprocess.run([node, "program.mjs"], cwd=folder, input=asked, capture_output=True, text=True, check=False)
        assert ran.returncode == 0, ran.stderr
        return json.loads(ran.stdout)

    return run
