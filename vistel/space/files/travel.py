"""Polymeshes and their pictures as bytes, for sites without their files, named by digests.

A polymesh goes without its pictures, which several may share: it names them. A digest is of the
content, not of the bytes, so that a receiver can check the assembled one.
"""

import hashlib
import io
import json
import zipfile
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from vistel.arrays import U8
from vistel.figure.making.source import Finish, SourceMaterial
from vistel.space.files.interior import Interior
from vistel.space.files.model import Polymesh
from vistel.undisturbed import undisturbed

MOST_UNPACKED = 256 << 20
"""Bytes that a polymesh may have in memory; a picture as many texels as a quarter of it."""
MOST_MATERIALS = 4096
_ARRAYS = ("vertices", "triangles", "uv", "uv_triangles", "material")
_SHAPES = {"vertices": 3, "triangles": 3, "uv": 2, "uv_triangles": 3}


def picture_digest(picture: U8) -> str:
    """A picture's name: equal pictures have equal digests."""
    return hashlib.sha256(f"{picture.shape}".encode() + picture.tobytes()).hexdigest()[:32]


def pack_model(model: Polymesh) -> bytes:
    """A polymesh without its pictures."""
    told = [[m.name, m.colour, "" if m.picture is None else picture_digest(m.picture), *finish_told(m)] for m in model.materials]
    out = io.BytesIO()
    arrays = {name: getattr(model, name) for name in _ARRAYS}
    np.savez_compressed(out, materials=np.frombuffer(json.dumps(told).encode(), np.uint8), **arrays)
    return out.getvalue()


def pack_picture(picture: U8) -> bytes:
    """A picture, to the last bit."""
    out = io.BytesIO()
    Image.fromarray(picture).save(out, "PNG", compress_level=4)
    return out.getvalue()


def pictures_in(data: bytes) -> tuple[str, ...]:
    """Digests of the pictures that a packed polymesh names. Raises ValueError for invalid data."""
    return tuple(dict.fromkeys(digest for _, _, digest, _ in _materials(_read(data)) if digest))


def unpack_model(data: bytes, digest: str, pictures: Mapping[str, U8]) -> Polymesh:
    """The polymesh of that digest. pictures: those it names. Raises ValueError for what is not it."""
    arrays = _read(data)
    for name, width in _SHAPES.items():
        if arrays[name].ndim != 2 or arrays[name].shape[1] != width:
            raise ValueError(f"polymesh: {name} of shape {arrays[name].shape}")
    materials = tuple(
        SourceMaterial(
            name, None if colour is None else (colour[0], colour[1], colour[2]), pictures[which] if which else None, finish
        )
        for name, colour, which, finish in _materials(arrays)
    )
    a = {name: np.ascontiguousarray(arrays[name]) for name in _ARRAYS}
    model = Polymesh(a["vertices"], a["triangles"], a["uv"], a["uv_triangles"], a["material"], materials)
    if model.digest != digest:
        raise ValueError("polymesh: it is another one than its name says")
    # A malicious sender could name one from which no picture can be made.
    faces, places = model.triangles, model.uv_triangles
    sound = (
        len(faces)
        and len(places) == len(faces) == len(model.material)
        and faces.min() >= 0
        and faces.max() < len(model.vertices)
        and places.min() >= -1
        and places.max() < len(model.uv)
        and model.material.min() >= 0
        and model.material.max() < len(materials)
        and np.isfinite(model.vertices).all()
        and np.isfinite(model.uv).all()
    )
    if not sound:
        raise ValueError("polymesh: faces of vertices that are not there")
    return model


def unpack_picture(data: bytes, digest: str) -> U8:
    """The picture (H, W, 3) of that digest. Raises ValueError for what is not it."""
    try:
        with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
            if image.mode != "RGB" or 4 * image.width * image.height > MOST_UNPACKED:
                raise ValueError(f"picture: {image.mode}, {image.width} by {image.height}")
            picture = np.asarray(image, np.uint8)
    except (OSError, SyntaxError, EOFError, Image.DecompressionBombError) as fault:
        raise ValueError(f"picture: {fault}") from fault
    if picture_digest(picture) != digest:
        raise ValueError("picture: it is another one than its name says")
    return picture


def packers(interior: Interior) -> dict[str, Callable[[], bytes]]:
    """Functions that pack each polymesh and picture of a room, by digest."""
    out: dict[str, Callable[[], bytes]] = {}
    for digest, model in interior.models.items():
        out[digest] = lambda model=model: pack_model(model)
        for picture in (m.picture for m in model.materials if m.picture is not None):
            out.setdefault(picture_digest(picture), lambda picture=picture: pack_picture(picture))
    return out


@undisturbed
def _read(data: bytes) -> dict[str, NDArray[Any]]:
    """The arrays of a packed polymesh. Raises ValueError."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as whole:
            if sum(part.file_size for part in whole.infolist()) > MOST_UNPACKED:
                raise ValueError("polymesh: too large")
        with np.load(io.BytesIO(data), allow_pickle=False) as found:
            return {name: found[name] for name in (*_ARRAYS, "materials")}
    except SystemError:
        raise
    except Exception as fault:  # zip, zlib and numpy raise errors of many types
        raise ValueError(f"polymesh: damaged ({fault})") from fault


def finish_told(m: SourceMaterial) -> list[list[float]]:
    """The entries of a material's row for its finish; none when it has no finish."""
    return [] if m.finish is None else [[m.finish.roughness, m.finish.metallic]]


def finish_read(more: list[list[float]]) -> Finish | None:
    """The other way. Raises ValueError for invalid data."""
    if not more:
        return None
    roughness, metallic = more[0]
    found = Finish.of(float(roughness), float(metallic))
    if found is None:
        raise ValueError("a material's finish that is no number")
    return found


def _materials(arrays: Mapping[str, NDArray[Any]]) -> list[tuple[str, list[int] | None, str, Finish | None]]:
    told: list[Any] | dict[str, Any] | str | float | None = json.loads(arrays["materials"].tobytes())
    if not isinstance(told, list) or len(told) > MOST_MATERIALS:
        raise ValueError("polymesh: materials that are none")
    out: list[tuple[str, list[int] | None, str, Finish | None]] = []
    for row in told:
        name, colour, digest, *more = row
        if not (isinstance(name, str) and isinstance(digest, str) and (colour is None or len(colour) == 3)):
            raise ValueError("polymesh: a material that is none")
        out.append((name, colour, digest, finish_read(more)))
    return out
