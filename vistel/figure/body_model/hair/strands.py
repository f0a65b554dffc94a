"""Pictures of strands: what of a card is hair, how light each strand is, and how it is turned.

A picture has the cap's strands in its upper part and columns of locks in its lower part; roots are at the top."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from vistel.arrays import F32, F64, U8
from vistel.figure.body_model.hair.strand_kernels import paint_strands  # pyright: ignore[reportUnknownVariableType]
from vistel.geometry.smoothstep import smooth

SIZE = 512
"""Texels of the picture's height and width."""
CAP_ROWS = 128
"""Of the cap's part, and of the shells' under it."""
LOCK_TOP = 2 * CAP_ROWS + 3
"""First row of the locks."""
COLUMNS = 8
"""Locks side by side: thick and dark ones first, then thick ones, then light ones, the last thin and ragged."""
INNER = (0, 1)
MIDDLE = (2, 3, 4)
OUTER = (5, 6)
WISPS = (7,)
_LONG = {"curly": (30.0, 80.0), "stubs": (7.0, 13.0)}
"""Least and most rows of strands of caps, where they are not 10 and 40."""
_SHORTEST = 6
"""Rows; shorter strands are not painted."""
KINDS = ("straight", "tufts", "wavy", "curly", "stubs")


@dataclass(frozen=True, eq=False)
class Strands:
    """shade: (H, W) how light, about 1. warm: (H, W) how far a strand's own colour is off, about 0; opacity: (H, W), normal: (H, W,
    3) as `vistel.figure.avatar.patch.Patch` has them."""

    shade: F32
    warm: F32
    opacity: U8
    normal: U8


def cap_box(shell: bool = False) -> F64:
    """(4,) lowest u and v, highest u and v of the cap's strands, or of a shell's over it; the hairline is at the lowest v."""
    first = CAP_ROWS if shell else 0
    return np.array((0.0, 1.0 - (first + CAP_ROWS - 1.0) / SIZE, 1.0, 1.0 - (first + 1.0) / SIZE))


def lock_box(column: int) -> F64:
    """(4,) the same of a lock: tips at the lowest v."""
    wide = 1.0 / COLUMNS
    return np.array((column * wide, 0.5 / SIZE, (column + 1) * wide, 1.0 - LOCK_TOP / SIZE))


@cache
def strands(kind: str) -> Strands:
    """The picture of a kind of hair; always the same, so that people share its textures."""
    rng = np.random.default_rng(7 + KINDS.index(kind))
    # In texels: place across, from which row to which, half a strand's width, how light, how it bends.
    canvas = _Canvas(SIZE, SIZE)
    canvas.shade[:] = 0.82
    # Short strands do not hide the skin between them, unless they are many; each has a light of its own.
    fill, differ = (7800, 0.30) if kind == "stubs" else (3900, 0.15)
    for first, count in ((0, fill), (CAP_ROWS, 1350)):
        last = first + CAP_ROWS - 2.0
        for _ in range(count):
            # From the hairline, at the part's lowest row, upwards; there hairs are fine and lean either way.
            low = rng.random() < (0.30 if first or kind == "stubs" else 0.5)
            end = last - (rng.gamma(2.8, 8.5) if low else rng.uniform(12.0, CAP_ROWS))
            start = max(first + 1.0, end - rng.uniform(*_LONG.get(kind, (10.0, 40.0))))
            sways, bends = (7.0, 2.2) if kind == "curly" else (4.0, 0.35) if low else (1.4, 0.8)
            wave = sways * rng.uniform(0.3, 1.0), bends * rng.uniform(0.6, 1.4), rng.uniform(0.0, 6.28)
            half = rng.uniform(0.28, 0.55) if low else rng.uniform(0.4, 0.75)
            canvas.strand(rng, rng.uniform(-4.0, SIZE + 4.0), (start, end), half, rng.normal(0.94, differ), wave, (0.25, 0.35))
    # Farther in no skin is seen; where that begins differs from place to place.
    noise = np.convolve(rng.normal(0.0, 1.0, SIZE + 4), np.ones(5) / np.sqrt(5.0), "valid")
    begins = CAP_ROWS - 37.0 - 8.0 * np.clip(noise, -1.5, 1.0)
    top, wide = LOCK_TOP, SIZE // COLUMNS
    # In short hair one looks between locks; long ones lie side by side, and a dark one among them is a stain.
    inner, root = (0.74, 0.66) if kind in ("tufts", "curly", "stubs") else (0.88, 0.93)
    sway = {"straight": 2.2, "tufts": 3.0, "wavy": 5.0, "curly": 4.0, "stubs": 3.0}[kind]
    for column in range(COLUMNS):
        group = next(k for k, those in enumerate((INNER, MIDDLE, OUTER, WISPS)) if column in those)
        count, light = ((110, inner), (95, 0.93), (70, 1.04), (24, 0.97))[group]
        clump = rng.uniform(0.1, 0.35)
        for _ in range(count):
            x = 0.5 * wide + (0.42 * wide - sway) * np.clip(rng.normal(0.0, 0.52), -1.0, 1.0)
            first, last = rng.gamma(1.3, (5.0, 16.0, 22.0, 10.0)[group]), rng.gamma(1.4, (20.0, 30.0, 38.0, 60.0)[group])
            if kind == "tufts":
                first, last = first + rng.uniform(0.0, 95.0), last + rng.uniform(0.0, 110.0)
            else:
                # Roots of a lock do not lie in a line, nor do its tips.
                first, last = first + rng.uniform(0.0, 24.0), last + rng.uniform(0.0, 40.0)
            wave = (
                sway * rng.uniform(0.2, 0.6),
                (2.0 if kind == "straight" else 5.0) * rng.uniform(0.3, 0.8),
                rng.uniform(0.0, 6.28),
            )
            canvas.strand(rng, column * wide + x, (top + first, SIZE - 2.0 - last), rng.uniform(0.5, 1.0),
                          light * rng.normal(1.0, 0.17), wave, (0.12, 0.30),
                          towards=((column + 0.5 + rng.normal(0.0, 0.06)) * wide, clump))  # fmt: skip
    canvas.paint()
    canvas.opacity[:CAP_ROWS] = np.maximum(canvas.opacity[:CAP_ROWS], np.arange(CAP_ROWS)[:, None] < begins)
    canvas.darken_cap()
    canvas.darken_roots(top, root)
    return canvas.done()


class _Canvas:
    """What strands are painted on, later ones over earlier ones."""

    def __init__(self, height: int, width: int) -> None:
        self.shade, self.warm, self.opacity, self.turn = (np.zeros((height, width), np.float32) for _ in range(4))
        self._strands: list[tuple[float, ...]] = []

    def strand(
        self,
        rng: np.random.Generator,
        x: float,
        rows: tuple[float, float],
        half: float,
        light: float,
        wave: tuple[float, float, float],
        taper: tuple[float, float],
        towards: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        """From row to row; half: of its width; wave: how far it sways [texels], how often, and from where on [rad]; taper: shares
        of its length over which it grows thick and thin; towards: where strands meet at the tip, and how far they do."""
        if min(SIZE - 1, int(rows[1])) - max(0, int(rows[0])) >= _SHORTEST:
            self._strands.append((x, *rows, half, light, float(rng.normal()), *wave, *taper, *towards))

    def paint(self) -> None:
        """All strands, in their order."""
        paint_strands(np.array(self._strands), self.shade, self.warm, self.opacity, self.turn)

    def darken_roots(self, top: int, least: float) -> None:
        """Little light comes to the roots of locks, which others cover; tips are bleached. least: how light roots are."""
        s = np.linspace(0.0, 1.0, len(self.shade) - top)[:, None]
        self.shade[top:] *= least + (1.0 - least) * smooth(s / 0.35) + 0.12 * s

    def darken_cap(self) -> None:
        """Deep inside, the cap lies under other hair."""
        s = np.linspace(1.0, 0.0, CAP_ROWS)[:, None]
        self.shade[:CAP_ROWS] *= 0.96 - 0.12 * smooth(s / 0.3)

    def done(self) -> Strands:
        """The picture. Where nothing is, it has the shade of what is near, as small versions of it mix both."""
        on = self.opacity > 0.4
        for column in range(COLUMNS):
            part = slice(LOCK_TOP, None), slice(column * SIZE // COLUMNS, (column + 1) * SIZE // COLUMNS)
            mean = self.shade[part][on[part]].mean()
            fill = ~on[part]
            self.shade[part][fill] = mean
        z = np.sqrt(np.maximum(0.0, 1.0 - self.turn**2))
        normal = np.stack([self.turn, np.zeros_like(z), z], axis=-1)
        return Strands(
            self.shade,
            self.warm,
            np.round(255.0 * self.opacity).astype(np.uint8),
            np.round(127.5 + 127.0 * normal).astype(np.uint8),
        )


def painted(kind: str, colour: tuple[float, float, float], grey: float, rng: np.random.Generator) -> U8:
    """(H, W, 3) sRGB of a kind of hair in a colour (0 to 255). grey: share of strands that have none."""
    s = strands(kind)
    base = np.array(colour, np.float32)
    own = s.warm[..., None] * np.array((0.022, 0.0, -0.022), np.float32)
    out = base * s.shade[..., None] * (1.0 + own)
    if grey > 0.0:
        cut = float(np.quantile(s.warm, 1.0 - grey)) + 0.05 * float(rng.normal())
        white = np.clip(4.0 * (s.warm - cut), 0.0, 1.0)[..., None]
        out = out * (1.0 - 0.75 * white) + 0.75 * white * np.array((186.0, 183.0, 180.0), np.float32) * s.shade[..., None]
    return np.clip(out, 0.0, 255.0).astype(np.uint8)
