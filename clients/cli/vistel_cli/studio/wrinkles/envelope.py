"""Binary answers: a JSON head, then arrays one after the other, as `clients/web/studio/api.ts` reads them.

The first four bytes are the length of the head, little-endian. Its `arrays` give name, kind (f4, u4 or u1) and shape. Each
array begins at a multiple of four bytes after the head. Spaces fill the head up to such a length.
"""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

_KINDS = {"f4": np.float32, "u4": np.uint32, "u1": np.uint8}


def packed(head: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """The bytes of an answer. Raises KeyError for arrays of other kinds."""
    said: list[dict[str, Any]] = []
    parts: list[bytes] = []
    for name, array in arrays.items():
        kind = next((k for k, t in _KINDS.items() if array.dtype == t), None)
        if kind is None:
            raise KeyError(f"{name}: is {array.dtype}, expected one of {', '.join(_KINDS)}")
        data = np.ascontiguousarray(array).tobytes()
        said.append({"name": name, "kind": kind, "shape": array.shape})
        parts.append(data + bytes(-len(data) % 4))
    first = json.dumps({**head, "arrays": said}, separators=(",", ":")).encode()
    first += b" " * (-len(first) % 4)
    return b"".join([len(first).to_bytes(4, "little"), first, *parts])
