"""Surface properties of a UsdPreviewSurface besides colour, each picture laid as that of the colour."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import UsdShade

from vistel.arrays import U8
from vistel.figure.avatar.patch import Patch
from vistel.figure.making.maps import CLAMP, MIRROR, REPEAT, Lying, laid, times, together
from vistel.figure.making.source import Finish

_WRAPS = {"repeat": REPEAT, "mirror": MIRROR}
_CHANNELS = {"r": 0, "g": 1, "b": 2}


@dataclass(frozen=True)
class Inputs:
    """How pictures of inputs are found. picture: (H, W, 3), how it lies, channel that is read; alpha: (H, W) opacity in the
    picture that feeds an input; note: called with what was left out."""

    picture: Callable[[Any], tuple[U8, Lying, str] | None]
    alpha: Callable[[Any], U8 | None]
    note: Callable[[str], None]


def patch_read(shader: Any, read: Inputs, like: Lying, finish: Finish | None) -> Patch | None:
    """The patch of a UsdPreviewSurface whose colour lies `like`; finish: its factors, or means of their pictures."""
    rough, metal = (finish.roughness, finish.metallic) if finish is not None else (0.5, 0.0)
    occlusion, green, blue = (_channel(shader, name, read, like) for name in ("occlusion", "roughness", "metallic"))
    opacity = _channel(shader, "opacity", read, like)
    if opacity is None and (solid := _number(shader, "opacity", 1.0)) < 1.0:
        opacity = np.full((4, 4), round(255 * max(0.0, solid)), np.uint8)
    cutoff = _number(shader, "opacityThreshold", 0.0)
    glow, glow_picture = _value(shader, "emissiveColor", (0.0, 0.0, 0.0)), _colours(shader, "emissiveColor", read, like)
    if glow_picture is not None:
        glow = _scale(shader.GetInput("emissiveColor"))
    normal = _colours(shader, "normal", read, like)
    return Patch(
        roughness=rough,
        metallic=metal,
        finish=together([occlusion, green, blue], (255, round(255 * rough), round(255 * metal))),
        normal=normal,
        glow=glow,
        glow_picture=glow_picture,
        opacity=opacity,
        cutoff=min(1.0, cutoff) or 0.5,
        blend=opacity is not None and cutoff <= 0.0,
    )


def connections(source: Any) -> list[Any]:
    """What feeds an input or output; in some versions of USD the invalid sources come beside it."""
    found: Any = source.GetConnectedSources()
    return list(found[0] if isinstance(found, tuple) else found)  # pyright: ignore[reportUnknownArgumentType]


def texture_reader(source: Any) -> Any:
    """The UsdUVTexture that feeds an input, None without one."""
    for _ in range(4):
        rows = connections(source)
        if not rows:
            return None
        shader = UsdShade.Shader(rows[0].source.GetPrim())
        if shader and str(shader.GetIdAttr().Get()) == "UsdUVTexture":
            return shader
        source = UsdShade.ConnectableAPI(rows[0].source.GetPrim()).GetInput(rows[0].sourceName)
        if not source:
            return None
    return None


def lying_of(reader: Any) -> Lying:
    """How the picture of a UsdUVTexture lies: a UsdTransform2d scales, then turns, then moves."""
    wrap = tuple(_WRAPS.get(str(reader.GetInput(n).Get()) if reader.GetInput(n) else "", CLAMP) for n in ("wrapS", "wrapT"))
    if not any(reader.GetInput(n) for n in ("wrapS", "wrapT")):
        wrap = (REPEAT, REPEAT)
    matrix, named, at = np.eye(3), "st", reader.GetInput("st")
    for _ in range(4):
        rows = connections(at) if at else []
        if not rows:
            break
        shader = UsdShade.Shader(rows[0].source.GetPrim())
        kind = str(shader.GetIdAttr().Get()) if shader else ""
        if kind == "UsdTransform2d":
            scale, move = _pair(shader, "scale", (1.0, 1.0)), _pair(shader, "translation", (0.0, 0.0))
            turn = shader.GetInput("rotation")
            angle = math.radians(float(turn.Get() or 0.0)) if turn else 0.0
            c, s = math.cos(angle), math.sin(angle)
            step = np.array([[c * scale[0], -s * scale[1], move[0]], [s * scale[0], c * scale[1], move[1]], [0.0, 0.0, 1.0]])
            matrix, at = matrix @ step, shader.GetInput("in")
        elif kind.startswith("UsdPrimvarReader"):
            attribute = shader.GetInput("varname")
            named = str((attribute.Get() if attribute else None) or "st")
            break
        else:
            break
    return Lying(named, matrix, (wrap[0], wrap[1]))


def channel_of(source: Any) -> str:
    """The output of a texture that an input reads."""
    rows = connections(source)
    return str(rows[0].sourceName) if rows else "r"


def _channel(shader: Any, name: str, read: Inputs, like: Lying) -> U8 | None:
    source = shader.GetInput(name)
    if not source or not source.HasConnectedSource():
        return None
    if channel_of(source) == "a":
        found, reader = read.alpha(source), texture_reader(source)
        its = lying_of(reader) if reader is not None else like
    else:
        found = read.picture(source)
        if found is None:
            return None
        picture, its, channel = found
        found = np.ascontiguousarray(picture[..., _CHANNELS.get(channel, 0)])
    out = None if found is None else laid(found, its, like)
    if found is not None and out is None:
        read.note(f"its {name} has texture coordinates of its own: left out; bake it on those of its colour")
    factor = _factor(source)[_CHANNELS.get(channel_of(source), 0)] if out is not None else 1.0
    return times(out, factor)


def _colours(shader: Any, name: str, read: Inputs, like: Lying) -> U8 | None:
    source = shader.GetInput(name)
    found = read.picture(source) if source and source.HasConnectedSource() else None
    out = None if found is None else laid(found[0], found[1], like)
    if found is not None and out is None:
        read.note(f"its {name} has texture coordinates of its own: left out; bake it on those of its colour")
    return out


def _factor(source: Any) -> tuple[float, ...]:
    reader = texture_reader(source)
    scale = reader.GetInput("scale") if reader is not None else None
    value = scale.Get() if scale else None
    return (1.0, 1.0, 1.0, 1.0) if value is None else tuple(float(x) for x in value)


def _scale(source: Any) -> tuple[float, float, float]:
    r, g, b = _factor(source)[:3]
    return r, g, b


def _number(shader: Any, name: str, otherwise: float) -> float:
    source = shader.GetInput(name)
    value = source.Get() if source and not source.HasConnectedSource() else None
    return float(value) if isinstance(value, int | float) else otherwise


def _value(shader: Any, name: str, otherwise: tuple[float, float, float]) -> tuple[float, float, float]:
    source = shader.GetInput(name)
    value = source.Get() if source and not source.HasConnectedSource() else None
    return otherwise if value is None else (float(value[0]), float(value[1]), float(value[2]))


def _pair(shader: Any, name: str, otherwise: tuple[float, float]) -> tuple[float, float]:
    source = shader.GetInput(name)
    value = source.Get() if source else None
    return otherwise if value is None else (float(value[0]), float(value[1]))
