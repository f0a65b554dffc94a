"""The container of a glTF 2.0 file that is being written: accessors and views over one buffer, packed as GLB."""

import io
import json
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

VERTICES = 34962
"""Target of a buffer view of vertices (ARRAY_BUFFER)."""
INDICES = 34963
"""Target of a buffer view of indices (ELEMENT_ARRAY_BUFFER)."""
_KINDS = {np.dtype(np.float32): 5126, np.dtype(np.uint8): 5121, np.dtype(np.uint16): 5123, np.dtype(np.uint32): 5125}
"""Component types of accessors."""
_SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


@dataclass
class Binary:
    """The buffer so far, and what lies where in it."""

    data: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    accessors: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])

    def accessor(self, array: NDArray[Any], *, target: int | None = VERTICES, bounds: bool = False) -> int:
        """Index of a new accessor for an array (n, columns)."""
        rows = np.ascontiguousarray(array)
        columns = rows.shape[1]
        kind = rows.dtype
        if columns == 16:
            target = None
        row: dict[str, Any] = {
            "bufferView": self.view(rows.tobytes(), target),
            "componentType": _KINDS[kind],
            "count": len(rows),
            "type": _SHAPES[columns],
        }
        if bounds:
            row |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(row)
        return len(self.accessors) - 1

    def view(self, data: bytes, target: int | None = None) -> int:
        """Index of a new view of these bytes."""
        self.data += b"\0" * (-len(self.data) % 4)
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        self.views.append(view)
        self.data += data
        return len(self.views) - 1

    def glb(self, tree: dict[str, Any]) -> bytes:
        """The file: `tree`, completed by the buffer's parts, and the buffer."""
        data = bytes(self.data)
        tree = tree | {"accessors": self.accessors, "bufferViews": self.views, "buffers": [{"byteLength": len(data)}]}
        text = json.dumps(tree, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        data += b"\0" * (-len(data) % 4)
        head = struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(data))
        return head + struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data


def png(picture: NDArray[np.uint8]) -> bytes:
    """A picture (H, W, 3) as PNG."""
    out = io.BytesIO()
    Image.fromarray(picture).save(out, "PNG")
    return out.getvalue()
