"""Peers of the deformation that are programs of their own: run, where they are, beside ours.

`VISTEL_PEERS` names a folder with `blender_peers.py`, `collision_peers.py` and `softbody_peers.py`, each of which
prints one line of JSON (default: `../shared/peers` beside the repository); `VISTEL_PEER_PYTHON` the interpreter
that has the peers' packages (default: this one). What is absent is passed over.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any


def peer(script: str, *arguments: str) -> dict[str, Any] | None:
    """What a peer's script printed, or None where the script or its packages are absent."""
    folder = Path(os.environ.get("VISTEL_PEERS", Path(__file__).parents[3] / "shared" / "peers"))
    if not (folder / script).is_file():
        return None
    done = subprocess.run(
        [os.environ.get("VISTEL_PEER_PYTHON", sys.executable), str(folder / script), *arguments],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    return json.loads(lines[-1]) if done.returncode == 0 and lines else None
