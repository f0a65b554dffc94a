"""An avatar as one piece of bytes to send: arrays without any code or path in them, and its texture as JPEG.

    "VISTELAV"  format (u32)  bytes of the arrays (u32)  the arrays (.npz, `avatar_file`)  the texture (JPEG)

The same avatar gives the same bytes, so they may be named by their digest.
"""

import io
import struct
import tempfile
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.avatar.check import MOST_TEXELS, AvatarFileError, check_avatar
from vistel.figure.formats.avatar_file import load_avatar, save_avatar

ENDING = ".parcel"
TEXELS = 2048
"""Texels along a side of the texture in a parcel, at most."""
QUALITY = 90
"""JPEG quality of the texture in a parcel."""
PATCH_TEXELS = 1024
"""Texels along a side of the pictures of patches, at most."""
MOST_UNPACKED = 256 << 20
"""Bytes of all arrays together."""
_HEAD = struct.Struct("<8sII")
_MAGIC = b"VISTELAV"
_FORMAT = 1


def pack(avatar: Avatar) -> bytes:
    """The parcel of an avatar. Raises AvatarFileError when it could not be unpacked again."""
    check_avatar(avatar, f"avatar {avatar.name!r}")
    image = Image.fromarray(avatar.albedo)
    if max(image.size) > TEXELS:
        image.thumbnail((TEXELS, TEXELS), Image.Resampling.LANCZOS)
    picture = io.BytesIO()
    image.save(picture, "JPEG", quality=QUALITY, subsampling=0)
    bare = tuple(replace(level, name="", albedo=_NOTHING) for level in avatar.coarser)
    patches = tuple(p.reduced(PATCH_TEXELS) for p in avatar.patches)
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder:
        path = Path(folder) / "arrays.npz"
        save_avatar(replace(avatar, name="", albedo=_NOTHING, coarser=bare, patches=patches), path, small=True)
        arrays = path.read_bytes()
    return _HEAD.pack(_MAGIC, _FORMAT, len(arrays)) + arrays + picture.getvalue()


def unpack(data: bytes, where: str) -> Avatar:
    """The avatar in a parcel, nameless. Raises AvatarFileError, one line that begins with `where`, for anything else, and for
    what is far larger than it looks."""
    if len(data) < _HEAD.size or data[:8] != _MAGIC:
        raise AvatarFileError(f"{where}: no avatar")
    _, version, size = _HEAD.unpack_from(data)
    if version != _FORMAT:
        raise AvatarFileError(f"{where}: parcel format {version}, expected {_FORMAT}; update the older VISTEL")
    arrays, picture = data[_HEAD.size : _HEAD.size + size], data[_HEAD.size + size :]
    try:
        with zipfile.ZipFile(io.BytesIO(arrays)) as file:
            whole = sum(entry.file_size for entry in file.infolist())
    except (zipfile.BadZipFile, ValueError, EOFError, OSError, NotImplementedError, struct.error) as fault:
        raise AvatarFileError(f"{where}: not a whole avatar ({fault})") from fault
    if whole > MOST_UNPACKED:
        raise AvatarFileError(f"{where}: {whole / 1e6:.0f} MB of arrays, expected at most {MOST_UNPACKED / 1e6:.0f} MB")
    try:
        with Image.open(io.BytesIO(picture), formats=("JPEG",)) as image:
            if max(image.size) > MOST_TEXELS:
                raise AvatarFileError(f"{where}: a texture of {image.size} texels, expected at most {MOST_TEXELS}")
            albedo = np.asarray(image.convert("RGB"), np.uint8)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as fault:
        if isinstance(fault, AvatarFileError):
            raise
        raise AvatarFileError(f"{where}: a texture that cannot be read ({fault})") from fault
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder:
        path = Path(folder) / "avatar.npz"
        path.write_bytes(arrays)
        try:
            bare = load_avatar(path)
        except AvatarFileError as fault:
            raise AvatarFileError(f"{where}: {str(fault).removeprefix(f'{path}: ')}") from fault
        except (MemoryError, OverflowError) as fault:
            raise AvatarFileError(f"{where}: arrays larger than any avatar's") from fault
    avatar = replace(bare, albedo=albedo, coarser=tuple(replace(level, albedo=albedo) for level in bare.coarser))
    check_avatar(avatar, where)
    return avatar


_NOTHING = np.zeros((1, 1, 3), np.uint8)
