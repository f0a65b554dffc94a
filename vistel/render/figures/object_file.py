"""Objects of the library as bytes, and back to the last bit: what they hold, never code. Reading calls nothing that the bytes name:
it makes empty objects of classes that this program has loaded already, and fills in their attributes, or lets the class do so
(`__setstate__`).

A file is a head (JSON: every value once, by number, so that what is shared stays shared) and the numbers of all arrays behind it,
which an array read from it shows without a copy.
"""

import json
import math
import sys
from collections.abc import Mapping
from types import MethodType
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from vistel.arrays import U8

ROOM = "vistel."
"""Classes of these modules may be read."""
_MAGIC = b"VISTEL objects 1\n"
_ALIGNMENT = 64
_NOT_YET = object()
_KINDS = "biuf"
"""NumPy's letters of numbers and truth values: arrays of anything else are refused."""


class ObjectFileError(ValueError):
    """Bytes that are no such file, or an object of a kind that none may hold."""


def to_bytes(value: object) -> list[bytes | memoryview]:
    """In pieces, so that arrays are not copied. Raises ObjectFileError for what cannot be kept."""
    writer = _Writer()
    root = writer.number(value)
    head = json.dumps([root, writer.values], separators=(",", ":")).encode()
    head += b" " * (-(len(_MAGIC) + 8 + len(head)) % _ALIGNMENT)
    pieces: list[bytes | memoryview] = [_MAGIC, len(head).to_bytes(8, "little"), head]
    for array in writer.arrays:
        pieces += [array.reshape(-1).view(np.uint8).data, bytes(-array.nbytes % _ALIGNMENT)]
    return pieces


def from_bytes(data: U8) -> object:
    """What `to_bytes` made, of all its bytes (n,); arrays are parts of `data`. Raises ObjectFileError."""
    begin = len(_MAGIC) + 8
    first = data[:begin].tobytes()
    if not first.startswith(_MAGIC) or len(first) < begin:
        raise ObjectFileError("no file of objects")
    end = begin + int.from_bytes(first[len(_MAGIC) :], "little")
    try:
        root, values = json.loads(data[begin:end].tobytes())
        return _Reader(data, end, values).value(root)
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError, OverflowError) as e:
        raise ObjectFileError(f"damaged: {type(e).__name__}: {str(e)[:100]}") from e


class _Writer:
    def __init__(self) -> None:
        self.values: list[Any] = []
        self.arrays: list[NDArray[Any]] = []
        self._numbers: dict[int, int] = {}
        self._kept: list[object] = []  # so that no two values share an id
        self._bytes = 0

    def number(self, value: object) -> int:
        """Where a value stands among the values."""
        found = self._numbers.get(id(value))
        if found is None:
            found = self._numbers[id(value)] = len(self.values)
            self._kept.append(value)
            self.values.append(None)
            self.values[found] = self._encoded(value)
        return found

    def _encoded(self, value: Any) -> Any:
        if value is None or isinstance(value, bool | int | float | str):
            if type(value) in (type(None), bool, int, float, str):
                return value
        elif isinstance(value, np.ndarray | np.generic):
            return self._array(cast("NDArray[Any]", value))
        elif type(value) in (tuple, list, set, frozenset):
            items: Any = value
            return [type(items).__name__, *(self.number(v) for v in items)]
        elif type(value) is dict:
            pairs = cast("dict[Any, Any]", value)
            return ["dict", *(self.number(x) for pair in pairs.items() for x in pair)]
        elif isinstance(value, MethodType):
            return ["method", self.number(value.__self__), value.__name__]
        elif type(value).__module__.startswith(ROOM):
            state: Mapping[str, Any] | None = getattr(value, "__dict__", None)
            if state is not None:
                names = [x for name, v in state.items() for x in (name, self.number(v))]
                return ["object", type(value).__module__, type(value).__qualname__, *names]
        raise ObjectFileError(f"{type(value).__module__}.{type(value).__qualname__}: cannot be kept")

    def _array(self, value: NDArray[Any]) -> Any:
        array = np.asarray(value)
        if array.dtype.kind not in _KINDS:
            raise ObjectFileError(f"an array of {array.dtype} cannot be kept")
        columns = array.flags.f_contiguous and not array.flags.c_contiguous
        flat = np.ascontiguousarray(array.T if columns else array)
        kind = "scalar" if isinstance(value, np.generic) else "columns" if columns else "array"
        entry = [kind, array.dtype.str, self._bytes, *array.shape]
        self.arrays.append(flat)
        self._bytes += flat.nbytes + -flat.nbytes % _ALIGNMENT
        return entry


class _Reader:
    def __init__(self, data: U8, begin: int, entries: list[Any]) -> None:
        self._data, self._begin, self._entries = data, begin, entries
        self._made: list[Any] = [_NOT_YET if type(t) is list else t for t in entries]

    def value(self, number: int) -> Any:
        made = self._made[number]
        if made is _NOT_YET:
            made = self._made[number] = self._build(number, self._entries[number])
        return made

    def _build(self, number: int, entry: list[Any]) -> Any:
        kind, rest = entry[0], entry[1:]
        if kind in ("array", "columns", "scalar"):
            return self._array(kind, *rest)
        if kind == "object":
            cls = _class(rest[0], rest[1])
            made = self._made[number] = object.__new__(cls)
            state = {name: self.value(n) for name, n in zip(rest[2::2], rest[3::2], strict=True)}
            fill = getattr(cls, "__setstate__", None)  # of tables with addresses of arrays, which are others now
            if issubclass(cls, BaseModel):
                made.__setstate__({"__dict__": state, "__pydantic_extra__": None, "__pydantic_private__": None})
            else:
                fill(made, state) if fill is not None else made.__dict__.update(state)
            return made
        if kind == "method":
            owner = self.value(rest[0])
            return MethodType(type(owner).__dict__[rest[1]], owner)
        if kind == "dict":
            pairs = self._made[number] = dict[Any, Any]()
            pairs.update((self.value(k), self.value(v)) for k, v in zip(rest[::2], rest[1::2], strict=True))
            return pairs
        if kind == "list":
            items = self._made[number] = list[Any]()
            items.extend(self.value(n) for n in rest)
            return items
        return {"tuple": tuple, "set": set, "frozenset": frozenset}[kind](self.value(n) for n in rest)

    def _array(self, kind: str, dtype: str, at: int, *shape: int) -> Any:
        form = np.dtype(dtype)
        if form.kind not in _KINDS or min(shape, default=0) < 0 or at < 0:
            raise ObjectFileError("damaged: an array of what is no numbers")
        count = math.prod(shape)
        if count == 0:
            return np.empty(shape, form)
        flat = np.frombuffer(self._data, form, count, self._begin + at)
        if kind == "scalar":
            return flat[0]
        return flat.reshape(shape[::-1]).T if kind == "columns" else flat.reshape(shape)


def _class(module: str, name: str) -> type[Any]:
    found: Any = sys.modules[module] if module.startswith(ROOM) else None
    for part in name.split("."):
        found = cast("dict[str, Any]", vars(found))[part]
    if not isinstance(found, type) or found.__module__ != module:
        raise ObjectFileError(f"damaged: {module}.{name} is no class")
    return found
