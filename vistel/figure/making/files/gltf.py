"""The container of glTF 2.0: JSON, buffers, accessors and pictures, from .glb, .vrm or .gltf with files beside it."""

import base64
import binascii
import json
import struct
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from vistel.figure.making.source import MakingError, beside

LARGEST = 512 * 1024 * 1024
_MAGIC = 0x46546C67
_JSON = 0x4E4F534A
_BIN = 0x004E4942
_TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
_COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_PACKED = {"KHR_draco_mesh_compression": "Draco", "EXT_meshopt_compression": "meshopt", "KHR_meshopt_compression": "meshopt"}


def as_object(value: Any) -> dict[str, Any]:
    """A JSON value that should be an object; empty where it is something else."""
    return cast(dict[str, Any], value) if isinstance(value, dict) else {}


def as_list(value: Any) -> list[Any]:
    """A JSON value that should be a list; empty where it is something else."""
    return cast(list[Any], value) if isinstance(value, list) else []


@dataclass(frozen=True)
class Document:
    """A glTF file. tree: its JSON; binary: the chunk of a .glb, empty otherwise."""

    path: Path
    tree: dict[str, Any]
    binary: bytes

    def rows(self, kind: str) -> list[dict[str, Any]]:
        """The array `kind` ("nodes", "meshes", ...) of the tree; empty where there is none."""
        found = self.tree.get(kind, [])
        out = as_list(found)
        if not isinstance(found, list) or not all(isinstance(row, dict) for row in out):
            raise MakingError(f"{self.path}: {kind}: expected a list of objects; export the file again")
        return out

    def row(self, kind: str, index: Any) -> dict[str, Any]:
        """One of them. Raises MakingError where it is not there."""
        rows = self.rows(kind)
        if not isinstance(index, int) or not 0 <= index < len(rows):
            raise MakingError(f"{self.path}: {kind}[{index}] of {len(rows)}; the file is damaged, export it again")
        return rows[index]

    def extension(self, name: str) -> dict[str, Any] | None:
        """The file's extension of that name."""
        out = self.tree.get("extensions", {}).get(name)
        return as_object(out) if isinstance(out, dict) else None

    @cached_property
    def _buffers(self) -> list[bytes]:
        return [self._uri(b["uri"]) if "uri" in b else self.binary for b in self.rows("buffers")]

    def _uri(self, uri: str) -> bytes:
        if uri.startswith("data:"):
            try:
                return base64.b64decode(uri.partition(",")[2], validate=False)
            except binascii.Error as fault:
                raise MakingError(f"{self.path}: data in it is not base64 ({fault}); export the file again") from fault
        name = unquote(uri)
        found = beside(name, self.path)
        try:
            if found.stat().st_size > LARGEST:
                raise MakingError(f"{found}: larger than 512 MB; reduce the mesh first")
            return found.read_bytes()
        except OSError as fault:
            raise MakingError(f"{self.path}: needs {name}, which cannot be read ({fault.strerror}); put it beside it") from fault

    def _view(self, index: int) -> tuple[bytes, int]:
        """Bytes of a buffer view, and its stride (0: packed)."""
        view = self.row("bufferViews", index)
        if not isinstance(view.get("buffer"), int) or not 0 <= view["buffer"] < len(self._buffers):
            raise MakingError(f"{self.path}: a buffer that is not there; export the file again")
        start, length = int(view.get("byteOffset", 0)), int(view.get("byteLength", 0))
        number: int = view["buffer"]
        data = self._buffers[number]
        if start < 0 or length < 0 or start + length > len(data):
            raise MakingError(f"{self.path}: {len(data)} bytes of data, {start + length} expected; it is cut short, fetch it again")
        return data[start : start + length], int(view.get("byteStride", 0))

    def array(self, index: int) -> NDArray[Any]:
        """(N, C) of an accessor; normalised integers become floats. Raises MakingError."""
        row = self.row("accessors", index)
        try:
            kind, columns, count = np.dtype(_TYPES[row["componentType"]]), _COLUMNS[row["type"]], int(row["count"])
            if not 0 <= count <= LARGEST // 16:
                raise ValueError(f"{count} rows")
            out = self._strided(row, kind, columns, count) if "bufferView" in row else np.zeros((count, columns), kind)
            if "sparse" in row:
                sparse = row["sparse"]
                where, what = sparse["indices"], sparse["values"]
                at = self._strided(where, np.dtype(_TYPES[where["componentType"]]), 1, int(sparse["count"]))[:, 0]
                out = out.copy()
                out[at] = self._strided(what, kind, columns, int(sparse["count"]))
        except (KeyError, TypeError, ValueError, IndexError) as fault:
            if isinstance(fault, MakingError):
                raise
            raise MakingError(f"{self.path}: accessor {index} is damaged ({fault}); export the file again") from fault
        if row.get("normalized") and kind.kind in "iu":
            return np.maximum(out / float(np.iinfo(str(kind)).max), -1.0).astype(np.float32)
        return out

    def _strided(self, row: dict[str, Any], kind: np.dtype[Any], columns: int, count: int) -> NDArray[Any]:
        data, stride = self._view(row["bufferView"])
        start, width = int(row.get("byteOffset", 0)), kind.itemsize * columns
        stride = stride or width
        if count and (start < 0 or stride < width or start + stride * (count - 1) + width > len(data)):
            raise MakingError(f"{self.path}: an accessor reaches beyond its data; the file is cut short, fetch it again")
        if not count:
            return np.zeros((0, columns), kind)
        return np.ndarray((count, columns), kind, data, start, (stride, kind.itemsize)).copy()

    def picture(self, image: Any) -> bytes:
        """Encoded picture of an image. Raises MakingError where it is missing."""
        row = self.row("images", image)
        return self._uri(row["uri"]) if "uri" in row else self._view(row.get("bufferView", -1))[0]


def read_document(path: Path) -> Document:
    """The glTF file at `path`. Raises MakingError, OSError."""
    if path.stat().st_size > LARGEST:
        raise MakingError(f"{path}: larger than 512 MB; reduce the mesh to at most some 100,000 vertices first")
    data = path.read_bytes()
    binary = b""
    text = data
    if data[:4] == b"glTF":
        text, binary = _chunks(path, data)
    try:
        found = json.loads(text)
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as fault:
        raise MakingError(f"{path}: not a glTF file ({str(fault)[:80]}); expected glTF 2.0, GLB or VRM") from fault
    tree = as_object(found)
    if not isinstance(tree.get("asset"), dict):
        raise MakingError(f"{path}: not a glTF file (no asset); expected glTF 2.0, GLB or VRM")
    if not str(tree["asset"].get("version", "")).startswith("2"):
        raise MakingError(f"{path}: glTF {tree['asset'].get('version')}, expected 2.0; convert it, with Blender for instance")
    for name in tree.get("extensionsRequired", []):
        if name in _PACKED:
            raise MakingError(f"{path}: compressed with {_PACKED[name]}; export it without compression")
    return Document(path, tree, binary)


def _chunks(path: Path, data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary chunk of a GLB."""
    text, binary = b"", b""
    try:
        magic, version, length = struct.unpack_from("<III", data)
        if version != 2:
            raise MakingError(f"{path}: GLB {version}, expected 2; convert it, with Blender for instance")
        if magic != _MAGIC or length > len(data):
            raise MakingError(f"{path}: {len(data)} bytes, {length} expected; it is cut short, fetch it again")
        at = 12
        while at + 8 <= length:
            size, kind = struct.unpack_from("<II", data, at)
            if at + 8 + size > length:
                raise MakingError(f"{path}: a part of it is cut short; fetch it again")
            part = data[at + 8 : at + 8 + size]
            if kind == _JSON and not text:
                text = part
            elif kind == _BIN and not binary:
                binary = part
            at += 8 + size
    except struct.error as fault:
        raise MakingError(f"{path}: not a whole GLB file ({fault}); fetch it again") from fault
    return text, binary
