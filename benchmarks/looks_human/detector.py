"""The detectors: PyPI's MediaPipe in a virtual environment of its own, because it needs older packages than VISTEL. Its models are
in the wheel (Apache-2.0); nothing else is fetched. They are given files and answer in a file."""

import json
import subprocess
import sys
import venv
from pathlib import Path
from typing import Any

from benchmarks.progress import part
from vistel.figure.avatar.cache_folder import default_cache

PACKAGE = "mediapipe==0.10.21"
_SCRIPT = Path(__file__).with_name("detect.py")


def detected(folder: Path) -> dict[str, Any]:
    """What the detectors find in the pictures that `folder`/frames.json names, by file (see detect.py for what). Raises
    CalledProcessError where they cannot be installed or fail."""
    python = _environment()
    with part("detectors"):
        subprocess.run([str(python), str(_SCRIPT), str(folder)], check=True, capture_output=True, text=True)
    return json.loads((folder / "found.json").read_text("utf-8"))


def _environment() -> Path:
    """The detectors' Python; made the first time. pip's own settings (PIP_FIND_LINKS, ...) say where wheels are."""
    place = default_cache().parent / "detectors" / PACKAGE.replace("==", "-")
    python = place / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    whole = place / "installed"
    if not whole.is_file():
        with part(f"{PACKAGE}: an environment in {place}"):
            venv.create(place, with_pip=True, clear=True)
        with part(f"{PACKAGE}: installed (130 MB, once)"):
            install = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", PACKAGE]
            subprocess.run(install, check=True, capture_output=True, text=True)
        whole.touch()
    return python
