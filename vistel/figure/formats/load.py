"""Avatar files of any kind, by their endings."""

from pathlib import Path

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.avatar.check import AvatarFileError
from vistel.figure.formats.avatar_file import load_avatar
from vistel.figure.formats.gltf import GLTF_ENDINGS
from vistel.figure.formats.parcel import ENDING, pack, unpack
from vistel.figure.making.source import USD_ENDINGS, MakingError


def load_any(path: Path) -> Avatar:
    """An avatar file by its ending: USD (`vistel.figure.formats.usd`), glTF or VRM exported from one, a parcel or the
    cache's .npz. Raises AvatarFileError, OSError."""
    ending = path.suffix.lower()
    if ending == ".npz":
        return load_avatar(path)
    if ending == ENDING:
        return unpack(path.read_bytes(), str(path))
    if ending in GLTF_ENDINGS:
        return _load_gltf(path)
    if ending not in USD_ENDINGS:
        raise AvatarFileError(f"{path}: no avatar file; expected .usda, .usdc, .usd or .usdz (make one: vistel avatar import)")
    from vistel.figure.formats.usd import load_usd  # USD takes long to load

    return load_usd(path)


def read_parcel(path: Path) -> tuple[Avatar, bytes]:
    """An avatar file and its parcel; of a file that is one, its own bytes. Raises AvatarFileError, OSError."""
    if path.suffix.lower() == ENDING:
        data = path.read_bytes()
        return unpack(data, str(path)), data
    avatar = load_any(path)
    return avatar, pack(avatar)


def _load_gltf(path: Path) -> Avatar:
    from vistel.figure.formats.gltf_read import load_gltf  # so does what makes figures of meshes

    try:
        avatar = load_gltf(path)
    except MakingError as fault:
        raise AvatarFileError(str(fault)) from fault
    if avatar is None:
        raise AvatarFileError(f"{path}: no avatar of VISTEL; make one of it with: vistel avatar import {path.name} -o me.usda")
    return avatar
