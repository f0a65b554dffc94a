"""Files that a USD file refers to are read only from its own folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pxr import Ar, Usd

from vistel.figure.making.source import beside


def opened(path: Path) -> Any:
    """The stage of a file. Raises MakingError where it is composed of files of other folders; what pxr raises."""
    stage: Any = Usd.Stage.Open(str(path))
    for layer in stage.GetUsedLayers():
        if not layer.anonymous:
            _checked(layer.realPath, path)
    return stage


def asset_bytes(resolved: str, path: Path) -> bytes | None:
    """The bytes of what an asset of the file `path` was resolved to; None where nothing is there. Raises MakingError where it is in
    another folder."""
    if not resolved:
        return None
    _checked(resolved, path)
    found = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
    return None if found is None else bytes(found.GetBuffer())


def _checked(resolved: str, path: Path) -> None:
    beside(Ar.SplitPackageRelativePathOuter(resolved)[0] if Ar.IsPackageRelativePath(resolved) else resolved, path.absolute())
