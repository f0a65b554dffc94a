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
_QUALITY = 90
"""JPEG quality of pictures."""
_FEW_COLOURS = 256
"""Pictures of at most this many colours may be smaller as PNG, which also is exact."""


@dataclass
class Binary:
    """The buffer so far, and what lies where in it."""

    data: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    accessors: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])

    def accessor(
        self, array: NDArray[Any], *, target: int | None = VERTICES, bounds: bool = False, normalized: bool = False
    ) -> int:
        """Index of a new accessor for an array (n, columns). bounds: tell least and most of each column; normalized: integers
        stand for shares of their largest."""
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
        if normalized:
            row["normalized"] = True
        self.accessors.append(row)
        return len(self.accessors) - 1

    def sparse(self, array: NDArray[np.float32]) -> int:
        """Index of a new accessor for an array (n, 3), of which only the rows that are not zero are stored."""
        at = np.flatnonzero(array.any(axis=1)) if array.any() else np.zeros(1, np.int64)  # glTF wants one row at least
        index = smallest(at)
        self.accessors.append(
            {
                "componentType": _KINDS[array.dtype],
                "count": len(array),
                "type": _SHAPES[array.shape[1]],
                "min": array.min(axis=0).tolist(),
                "max": array.max(axis=0).tolist(),
                "sparse": {
                    "count": len(at),
                    "indices": {"bufferView": self.view(index.tobytes()), "componentType": _KINDS[index.dtype]},
                    "values": {"bufferView": self.view(array[at].tobytes())},
                },
            }
        )
        return len(self.accessors) - 1

    def image(self, picture: NDArray[np.uint8], name: str = "") -> dict[str, Any]:
        """Entry of `images` for a picture (H, W, 3), or (H, W, 4) with opacity: PNG where it has opacity or so few colours that
        this is smaller, else JPEG."""
        image = Image.fromarray(picture)
        ways = ["PNG"] if image.mode == "RGBA" else ["JPEG", "PNG"] if image.getcolors(_FEW_COLOURS) else ["JPEG"]
        data, way = min(((_encoded(image, way), way) for way in ways), key=lambda x: len(x[0]))
        return ({"name": name} if name else {}) | {"mimeType": f"image/{way.lower()}", "bufferView": self.view(data)}

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


def smallest(numbers: NDArray[np.integer]) -> NDArray[Any]:
    """Numbers of vertices in the smallest type that holds them; its largest is kept free, as glTF wants of indices."""
    return numbers.astype(np.uint16 if numbers.max(initial=0) < 65535 else np.uint32)


def _encoded(image: Image.Image, way: str) -> bytes:
    out = io.BytesIO()
    image.save(out, way, quality=_QUALITY, subsampling=0)  # which PNG passes over
    return out.getvalue()
