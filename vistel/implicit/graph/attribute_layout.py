"""Where the attributes of a shape are in its FieldProgram's channels."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vistel.arrays import F32, F64
from vistel.implicit.checks import ShapeError
from vistel.implicit.graph.attributes import Texture, texture_values
from vistel.implicit.graph.lower import Leaf


@dataclass(frozen=True)
class AttributeLayout:
    """Where each attribute's channels are in a FieldProgram: numbers, then the mass they are divided by.

    names: (name, first channel, k); textures: (name, channel of the mass, texture, leaf) of every textured leaf.
    """

    names: tuple[tuple[str, int, int], ...]
    textures: tuple[tuple[str, int, Texture, Leaf], ...]
    channels: int

    @classmethod
    def of(cls, leaves: Sequence[Leaf]) -> "AttributeLayout":
        """The layout for these leaves; ShapeError where one name has attributes of different lengths."""
        sizes: dict[str, int] = {}
        textured: list[tuple[str, Texture, Leaf]] = []
        for leaf in leaves:
            for name, value in leaf.values.items():
                if callable(value):
                    textured.append((name, value, leaf))
                    size = len(np.atleast_2d(texture_values(value, leaf.primitive, leaf.primitive.bounds))[0])
                else:
                    size = len(value)
                if sizes.setdefault(name, size) != size:
                    raise ShapeError(f"attributes: {name!r} has {sizes[name]} numbers on one shape and {size} on another")
        names: list[tuple[str, int, int]] = []
        first = 0
        for name, size in sizes.items():
            names.append((name, first, size))
            first += size + 1
        textures = tuple((name, first + i, texture, leaf) for i, (name, texture, leaf) in enumerate(textured))
        return cls(tuple(names), textures, first + len(textures))

    def rows(self, leaves: Sequence[Leaf]) -> F32:
        """(n, channels) what each leaf adds to every channel for each unit of its field."""
        rows = np.zeros((len(leaves), self.channels), np.float32)
        for i, leaf in enumerate(leaves):
            for name, first, size in self.names:
                value = leaf.values.get(name)
                weight = leaf.weights.get(name, 1.0)
                if value is None:
                    continue
                if not callable(value):
                    rows[i, first : first + size] = weight * np.asarray(value)
                rows[i, first + size] = weight
            for name, channel, _, textured in self.textures:
                if textured is leaf:
                    rows[i, channel] = leaf.weights.get(name, 1.0)
        return rows

    @property
    def groups(self) -> NDArray[np.int32]:
        """(g, 2) first channel and length of the attributes without textures, which the kernels divide themselves."""
        textured = {name for name, *_ in self.textures}
        rows = [(first, size) for name, first, size in self.names if name not in textured]
        return np.array(rows, np.int32).reshape(-1, 2)

    def unpack(self, channels: F32, points: ArrayLike | None) -> dict[str, F32]:
        """Attributes (..., k) from channels (..., C) at points (..., 3), which only textures need."""
        found: dict[str, F32] = {}
        textured = {name for name, *_ in self.textures}
        for name, first, size in self.names:
            if name not in textured:
                found[name] = channels[..., first : first + size]
                continue
            total = channels[..., first : first + size].copy()
            for texture_name, channel, texture, leaf in self.textures:
                if texture_name == name and points is not None:
                    mass = channels[..., channel]
                    reached = mass > 0
                    if reached.any():
                        total[reached] += mass[reached][:, None] * self._texture(texture, leaf, np.asarray(points)[reached])
            mass = channels[..., first + size : first + size + 1]
            found[name] = np.divide(total, mass, out=np.zeros_like(total), where=mass > 0)
        return found

    def _texture(self, texture: Texture, leaf: Leaf, points: F64) -> F32:
        linear = np.linalg.inv(leaf.world[:, :3])
        local = (points - leaf.world[:, 3]) @ linear.T
        return texture_values(texture, leaf.primitive, local).astype(np.float32)
