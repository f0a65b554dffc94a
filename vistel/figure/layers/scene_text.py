"""A layered model as a scene file, which `vistel trace` draws (docs/reference/scene-file.md)."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from vistel.arrays import F64
from vistel.figure.layers.model import Layer, LayeredModel, LayerPart
from vistel.implicit.blend import Blend
from vistel.implicit.graph.combine import Extremum, Placed, Ricci, Sum
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.offset import ConeSphere, Sphere, Sphylinder
from vistel.implicit.primitives.superquadric import Superellipsoid

COLOURS: dict[Layer, tuple[float, float, float]] = {
    "skin": (0.80, 0.55, 0.42),
    "joints": (0.80, 0.55, 0.42),
    "muscles": (0.62, 0.16, 0.13),
    "tendons": (0.85, 0.78, 0.66),
    "bones": (0.90, 0.85, 0.72),
    "veins": (0.45, 0.42, 0.55),
}


def scene_text(
    model: LayeredModel,
    layers: Sequence[Layer],
    *,
    blended: bool,
    eye: Iterable[float],
    target: Iterable[float],
    size: tuple[int, int] = (600, 800),
    field_of_view: float = 30.0,
) -> str:
    """TOML of the parts of `layers`: blended into one skin as the graph says, or each as it is. eye, target: of the camera
    [m]; field_of_view: across the width [degrees]."""
    parts, pairs = model.graph(layers)
    lines = [
        f"size = [{size[0]}, {size[1]}]",
        "background = [0.78, 0.80, 0.83]",
        'show = ["figure"]',
        "",
        "[camera]",
        f"position = {_list(eye)}",
        f"target = {_list(target)}",
        f"field_of_view = {field_of_view:g}",
        "",
        "[[lights]]",
        "position = [1.5, 3.0, 2.5]",
        "",
        "[[lights]]",
        "towards = [-1, 0.5, 0.4]",
        "colour = [0.35, 0.35, 0.4]",
        "shadows = false",
        "",
    ]
    used: list[Layer] = ["skin"] if blended else list(dict.fromkeys(p.layer for p in parts))
    for layer in used:
        lines += [f"[materials.{layer}]", f"colour = {_list(COLOURS[layer])}", ""]
    for part in parts:
        lines += [_part(part, blended), ""]
    names = ", ".join(f'"{p.name}"' for p in parts)
    lines += ["[shapes.figure]"]
    if blended:
        lines += ['kind = "selective"', f"of = [{names}]", f"blends = [{', '.join(f'[{i}, {j}]' for i, j in pairs)}]"]
        lines += ['material = "skin"']
    else:
        lines += ['kind = "union"', f"of = [{names}]"]
    return "\n".join(lines) + "\n"


def _part(part: LayerPart, blended: bool) -> str:
    """The table of one part, weighted for a blend."""
    entry = _entry(part.shape)
    if blended and part.weight != 1.0:
        entry = {"kind": '"sum"', "of": f"[{_inline(entry)}]", "weights": f"[{part.weight:.9g}]"}
    if not blended:
        entry["material"] = f'"{part.layer}"'
    return "\n".join([f"[shapes.{part.name}]", *(f"{key} = {value}" for key, value in entry.items())])


def _entry(shape: Shape) -> dict[str, str]:
    """Keys and values of a shape's table. Raises TypeError for kinds that layered models do not have."""
    match shape:
        case Sphere():
            return {"kind": '"sphere"', "centre": _list(shape.centre), "radius": _number(shape.radius), **_field(shape)}
        case Sphylinder():
            return {
                "kind": '"sphylinder"',
                "start": _list(shape.start),
                "end": _list(shape.end),
                "radius": _number(shape.radius),
                **_field(shape),
            }
        case ConeSphere():
            return {
                "kind": '"cone_sphere"',
                "start": _list(shape.start),
                "end": _list(shape.end),
                "radii": _list((shape.radius_start, shape.radius_end)),
                **_field(shape),
            }
        case Superellipsoid():
            return {"kind": '"superellipsoid"', "half_axes": _list(shape.sizes), "centre": _list(shape.centre), **_field(shape)}
        case Placed():
            axis, angle = _turn(shape.matrix[:, :3])
            return {
                **_entry(shape.shape),
                "rotate": f"{{ axis = {_list(axis)}, angle = {_number(angle)} }}",
                "translate": _list(shape.matrix[:, 3]),
            }
        case Sum():
            return {"kind": '"sum"', **_of(shape.shapes), "weights": _list(shape.weights)}
        case Ricci():
            return {"kind": '"union"', **_of(shape.shapes), "power": _number(shape.power)}
        case Extremum():
            return {"kind": '"union"', **_of(shape.shapes)}
        case _:
            raise TypeError(f"scene_text: no entry for {type(shape).__name__}")


def _of(shapes: Sequence[Shape]) -> dict[str, str]:
    return {"of": f"[{', '.join(_inline(_entry(s)) for s in shapes)}]"}


def _inline(entry: dict[str, str]) -> str:
    return f"{{ {', '.join(f'{key} = {value}' for key, value in entry.items())} }}"


def _field(shape: Sphere | Sphylinder | ConeSphere | Superellipsoid) -> dict[str, str]:
    """Sizes are those of the influence; weight and blend where they are not the usual ones."""
    out = {"sizes": '"influence"'}
    if shape.weight != 1.0:
        out["weight"] = _number(shape.weight)
    if shape.blend != Blend("quartic"):
        out["blend"] = f'{{ family = "{shape.blend.family}", warp = {_number(shape.blend.warp)} }}'
    return out


def _turn(rotation: F64) -> tuple[F64, float]:
    """Axis (3,) and angle [degrees] of a rotation matrix."""
    angle = math.acos(max(-1.0, min(1.0, (float(np.trace(rotation)) - 1.0) / 2.0)))
    if angle < 1e-9:
        return np.array((0.0, 1.0, 0.0)), 0.0
    if angle > math.pi - 1e-4:  # the matrix is symmetric there: its axis is the column that stays
        values, vectors = np.linalg.eigh(0.5 * (rotation + rotation.T))
        return vectors[:, int(np.argmax(values))], math.degrees(angle)
    m = rotation
    return np.array((m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1])), math.degrees(angle)


def _list(numbers: Iterable[float]) -> str:
    return f"[{', '.join(_number(x) for x in numbers)}]"


def _number(x: float) -> str:
    text = f"{float(x):.9g}"
    return text if any(c in text for c in ".en") else f"{text}.0"
