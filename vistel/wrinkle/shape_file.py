"""Wrinkle shapes as files: TOML, one shape each. The built-in ones lie in `shapes/` beside this file."""

from functools import cache
from pathlib import Path

from vistel.toml import file as toml
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.shape import Branch, Layer, WrinkleShape

FOLDER = Path(__file__).with_name("shapes")


def load_shape(path: Path) -> WrinkleShape:
    """Read and check a shape file. Raises WrinkleError, one line per fault."""
    return toml.read(path, WrinkleError).checked(WrinkleShape, WrinkleError)


def save_shape(shape: WrinkleShape, path: Path) -> None:
    """Write a shape so that people can read and edit it. Raises OSError."""
    path.write_text(shape_text(shape), "utf-8")


@cache
def builtin_shapes() -> dict[str, WrinkleShape]:
    """The taxonomy, by name."""
    found = [load_shape(path) for path in sorted(FOLDER.glob("*.toml"))]
    return {shape.name: shape for shape in found}


def shape_of(name: str, folder: Path | None = None) -> WrinkleShape:
    """A shape by the name of a built-in one, or by a file's (.toml) in `folder`. Raises WrinkleError."""
    if name.endswith(".toml"):
        return load_shape((folder or Path()) / name)
    known = builtin_shapes()
    if name not in known:
        raise WrinkleError(f"no wrinkle shape {name!r}; there are {', '.join(known)}, or a file that ends in .toml")
    return known[name]


def shape_text(shape: WrinkleShape) -> str:
    """The file of a shape."""
    lines = [f'name = "{shape.name}"', f"about = {_quoted(shape.about)}", f'material = "{shape.material}"', "profile = ["]
    lines += [f"  {_table(layer, Layer())}," for layer in shape.profile]
    lines += ["]"]
    for branch in shape.branches:
        lines += ["", "[[branches]]"]
        plain = Branch(points=branch.points)
        lines += [f'{key} = "{getattr(branch, key)}"' for key in ("start", "end") if getattr(branch, key) != getattr(plain, key)]
        if branch.cap != plain.cap:
            lines.append(f"cap = {branch.cap:g}")
        lines.append("points = [")
        for p in branch.points:
            rest = "".join(f", {key} = {getattr(p, key):g}" for key in ("intensity", "thickness") if getattr(p, key) != 1.0)
            lines.append(f"  {{ at = [{p.at[0]:g}, {p.at[1]:g}]{rest} }},")
        lines.append("]")
    return "\n".join(lines) + "\n"


def _table(layer: Layer, plain: Layer) -> str:
    said = {k: v for k, v in layer.model_dump().items() if v != getattr(plain, k)} or {"intensity": 1.0}
    return "{ " + ", ".join(f"{k} = {v:g}" for k, v in said.items()) + " }"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
