"""Pictures of linear light to PNG files."""

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import U8
from vistel.colour import srgb
from vistel.implicit.scene.model import SceneError


def encoded(light: NDArray[np.floating]) -> U8:
    """Linear light (..., 3) in 0..1 as sRGB bytes; brighter is cut off."""
    x = np.clip(np.asarray(light, np.float32), 0.0, 1.0)
    return np.take(_TABLE, (x * (len(_TABLE) - 1) + 0.5).astype(np.int32))


def _table() -> U8:
    return np.round(255 * srgb(np.linspace(0.0, 1.0, 1 << 14))).astype(np.uint8)


_TABLE = _table()


def check_writable(path: Path | str) -> Path:
    """The path, if a PNG can be written there. Raises SceneError; nothing is written."""
    file = Path(path)
    if file.suffix.lower() != ".png":
        raise SceneError(f"{file}: cannot write {file.suffix or 'a file without suffix'}, expected .png")
    if file.is_dir():
        raise SceneError(f"{file}: is a folder, expected a file")
    folder = file.parent
    if not folder.is_dir():
        raise SceneError(f"{file}: the folder {folder} does not exist")
    if not os.access(file if file.exists() else folder, os.W_OK):
        raise SceneError(f"{file}: cannot be written: permission denied")
    return file


def write_png(path: Path | str, light: NDArray[np.floating]) -> None:
    """Linear light (h, w, 3) as a PNG. Raises SceneError where it cannot be written."""
    from PIL import Image

    file = check_writable(path)
    try:
        Image.fromarray(encoded(light)).save(file)
    except OSError as e:
        raise SceneError(f"{file}: cannot be written: {e.strerror or e}") from e
