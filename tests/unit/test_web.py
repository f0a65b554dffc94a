"""The scripts that the Python packages carry are what the sources in clients/web give."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
WEB = ROOT / "clients/web"
BUNDLES = re.findall(r'"[^"]+\.ts": "([^"]+)"', (WEB / "build.mjs").read_text("utf-8"))  # that are committed


@pytest.fixture(scope="module")
def node() -> str:
    found = shutil.which("node")
    if found is None or not (WEB / "node_modules").is_dir():
        pytest.skip("node or clients/web/node_modules is not there (make web)")
    return found


def test_every_bundle_is_what_its_sources_give(node: str, tmp_path: Path) -> None:
    assert BUNDLES
    subprocess.run([node, "build.mjs", f"{tmp_path}/"], cwd=WEB, check=True, capture_output=True)
    for bundle in BUNDLES:
        assert (tmp_path / bundle).read_text("utf-8") == (ROOT / bundle).read_text("utf-8"), f"{bundle}: make web"


def test_the_sources_have_no_type_faults(node: str) -> None:
    command = [node, "node_modules/typescript/bin/tsc", "--noEmit"]
    done = subprocess.run(command, cwd=WEB, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_packages_are_pinned_with_their_hashes_and_no_file_names_a_registry() -> None:
    package, lock = ((WEB / name).read_text("utf-8") for name in ("package.json", "package-lock.json"))
    assert re.findall(r'"[\^~><*]', package) == []
    assert "resolved" not in lock and "registry" not in lock
    packages = {name: told for name, told in json.loads(lock)["packages"].items() if name}
    assert packages and all("integrity" in told for told in packages.values())
