"""Procedural colours: wooden floor, table top, walls with what hangs on them, the view from the window.

Every function returns (h, w, 3) linear colour in 0..1, first row at the top.
"""

import cv2
import numpy as np

from vistel.arrays import F32, F64


def _noise(rng: np.random.Generator, h: int, w: int, rows: int, columns: int) -> F32:
    """(h, w) smooth noise in -1..1 of about rows x columns bumps."""
    coarse = rng.uniform(-1.0, 1.0, (max(2, rows), max(2, columns))).astype(np.float32)
    return np.asarray(cv2.resize(coarse, (w, h), interpolation=cv2.INTER_CUBIC), np.float32)


def _mix(a: tuple[float, ...], b: tuple[float, ...], t: F32) -> F32:
    u = np.clip(t, 0.0, 1.0)[..., None]
    return (np.array(a, np.float32) * (1.0 - u) + np.array(b, np.float32) * u).astype(np.float32)


def floor(size: int, metres: float) -> F32:
    """Oak planks 0.16 m wide, laid along the picture's height."""
    rng = np.random.default_rng(11)
    along_side = np.arange(size, dtype=np.float64) * metres / size
    y, x = np.meshgrid(along_side, along_side, indexing="ij")
    width, length = 0.16, 1.6
    plank = (x // width).astype(int)
    shift: F64 = rng.uniform(0.0, length, int(plank.max()) + 1)
    along = y + shift[plank]
    piece = (along // length).astype(int)
    tone = rng.uniform(0.0, 1.0, (int(plank.max()) + 1, int(piece.max()) + 2))[plank, piece]
    warp = _noise(rng, size, size, 24, 96)
    grain = np.sin(2.0 * np.pi * (x / 0.021 + 3.0 * tone + 1.3 * warp)) * 0.5 + _noise(rng, size, size, 48, 900)
    fine = _noise(rng, size, size, 90, size)
    t = 0.5 * tone + 0.16 * grain + 0.16 * fine + 0.18
    out = _mix((0.185, 0.120, 0.072), (0.36, 0.262, 0.175), t.astype(np.float32))
    groove = np.minimum(np.abs(x / width - np.round(x / width)) * width, np.abs(along / length - np.round(along / length)) * length)
    return out * (1.0 - 0.5 * np.exp(-((groove / 0.006) ** 2)))[..., None].astype(np.float32)


def table_top(size: int, radius: float) -> F32:
    """Walnut veneer in straight grain with a thin pale ring near the edge; the picture spans the whole disc."""
    rng = np.random.default_rng(5)
    y, x = np.meshgrid(*(2 * [(np.arange(size) + 0.5) / size * 2.0 * radius - radius]), indexing="ij")
    warp = _noise(rng, size, size, 4, 7) + 0.4 * _noise(rng, size, size, 8, 20)
    rings = np.sin(2.0 * np.pi * (x / 0.045 + 1.1 * warp))
    pores = _noise(rng, size, size, 40, size)
    t = 0.52 + 0.22 * rings + 0.12 * _noise(rng, size, size, 3, 60) + 0.14 * pores
    out = _mix((0.095, 0.040, 0.020), (0.30, 0.150, 0.078), t.astype(np.float32))
    r = np.hypot(x, y) / radius
    inlay = np.exp(-(((r - 0.925) / 0.006) ** 2)).astype(np.float32)[..., None]
    out = out * (1 - inlay) + np.array((0.50, 0.36, 0.22), np.float32) * inlay
    return (out * (1.0 - 0.25 * np.clip((r - 0.975) / 0.025, 0, 1))[..., None]).astype(np.float32)


class Wall:
    """A wall of `width` x `height` metres to paint on; x from its left edge, y from the floor, as seen from inside."""

    def __init__(self, width: float, height: float, pixels_per_metre: float, seed: int) -> None:
        self.scale = pixels_per_metre
        h, w = round(height * pixels_per_metre), round(width * pixels_per_metre)
        self.height = height
        rng = np.random.default_rng(seed)
        plaster = 1.0 + 0.025 * _noise(rng, h, w, 12, 36) + 0.02 * _noise(rng, h, w, h, w)
        self.colour: F32 = (np.array((0.60, 0.585, 0.55), np.float32) * plaster[..., None]).astype(np.float32)
        self.glow: F32 = np.zeros((h, w), np.float32)
        self.rng = rng
        self.panel((0.0, 0.0, width, 0.95), (0.235, 0.285, 0.275))
        self.panel((0.0, 0.95, width, 0.99), (0.50, 0.42, 0.31))
        self.panel((0.0, 0.0, width, 0.11), (0.42, 0.36, 0.27))

    def pixels(self, box: tuple[float, float, float, float]) -> tuple[slice, slice]:
        """Rows and columns of a rectangle: left, bottom, right and top [m]."""
        x0, y0, x1, y1 = box
        return (
            slice(max(0, round((self.height - y1) * self.scale)), max(0, round((self.height - y0) * self.scale))),
            slice(max(0, round(x0 * self.scale)), max(0, round(x1 * self.scale))),
        )

    def panel(self, box: tuple[float, float, float, float], colour: tuple[float, float, float], edge: float = 0.0) -> None:
        """Fill a box with a colour, its rim lit from above left when `edge` > 0 [m]."""
        rows, columns = self.pixels(box)
        part = self.colour[rows, columns]
        part[:] = np.array(colour, np.float32) * (1.0 + 0.04 * self.rng.standard_normal(part.shape[:2])[..., None])
        n = max(1, round(edge * self.scale)) if edge > 0 else 0
        if n:
            part[:n] *= 1.35
            part[:, :n] *= 1.2
            part[-n:] *= 0.55
            part[:, -n:] *= 0.65

    def image(self, box: tuple[float, float, float, float], picture: F32, glow: float = 0.0) -> None:
        """Put a picture into a box; `glow` > 0 makes it shine by itself."""
        rows, columns = self.pixels(box)
        h, w = self.colour[rows, columns].shape[:2]
        self.colour[rows, columns] = cv2.resize(picture, (w, h), interpolation=cv2.INTER_AREA)
        self.glow[rows, columns] = glow

    def shadow(self, box: tuple[float, float, float, float], spread: float = 0.07) -> None:
        """The soft shadow of something hung in `box`."""
        mask = np.zeros(self.colour.shape[:2], np.float32)
        x0, y0, x1, y1 = box
        mask[self.pixels((x0 + 0.02, y0 - 0.05, x1 + 0.05, y1 - 0.03))] = 1.0
        k = max(3, round(spread * self.scale) | 1)
        self.colour *= 1.0 - 0.45 * cv2.GaussianBlur(mask, (k, k), 0)[..., None]

    def framed(self, box: tuple[float, float, float, float], picture: F32) -> None:
        """Hang a picture: frame, mount, picture."""
        x0, y0, x1, y1 = box
        self.shadow(box)
        self.panel(box, (0.10, 0.075, 0.055), 0.012)
        self.panel((x0 + 0.035, y0 + 0.035, x1 - 0.035, y1 - 0.035), (0.78, 0.76, 0.70))
        self.image((x0 + 0.12, y0 + 0.12, x1 - 0.12, y1 - 0.12), picture)


def view(h: int, w: int) -> F32:
    """Evening sky over hills, seen from a window."""
    rng = np.random.default_rng(3)
    y = np.linspace(1.0, 0.0, h, dtype=np.float32)[:, None] * np.ones((1, w), np.float32)
    out = _mix((0.98, 0.86, 0.68), (0.42, 0.62, 0.86), (y - 0.25) / 0.6)
    cloud = np.clip(_noise(rng, h, w, 9, 6) + 0.5 * _noise(rng, h, w, 22, 14) - 0.15, 0, 1) * np.clip((y - 0.35) * 3, 0, 1)
    out = out * (1 - 0.55 * cloud[..., None]) + np.array((1.0, 0.96, 0.90), np.float32) * (0.55 * cloud[..., None])
    x = np.arange(w)
    ridges = ((0.42, (0.47, 0.55, 0.62), 9), (0.33, (0.30, 0.40, 0.40), 14), (0.20, (0.14, 0.22, 0.14), 26))
    for level, colour, bumps in ridges:
        line = level + 0.07 * _noise(rng, 2, w, 2, bumps)[0] + 0.02 * _noise(rng, 2, w, 2, bumps * 6)[0]
        inside = y < line[x][None, :]
        shade = 1.0 - 0.35 * np.clip((line[None, :] - y) / 0.2, 0, 1)
        out = np.where(inside[..., None], np.array(colour, np.float32) * shade[..., None], out)
    return out.astype(np.float32)


def abstract(h: int, w: int, seed: int) -> F32:
    """A painting: bands of colour with a disc."""
    rng = np.random.default_rng(seed)
    palette = np.array(((0.55, 0.16, 0.09), (0.80, 0.52, 0.18), (0.10, 0.24, 0.33), (0.70, 0.64, 0.52), (0.22, 0.30, 0.22)))
    order = rng.permutation(len(palette))
    y = np.linspace(0.0, 1.0, h)[:, None] + 0.12 * _noise(rng, h, w, 5, 5)
    out = palette[order[np.clip((y * 4).astype(int), 0, 3)]]
    yy, xx = np.meshgrid(np.linspace(0, 1, h), np.linspace(0, 1, w) * w / h, indexing="ij")
    disc = (yy - rng.uniform(0.25, 0.4)) ** 2 + (xx - rng.uniform(0.3, 0.7) * w / h) ** 2 < 0.02
    out[disc] = palette[order[4]]
    return (out * (1.0 + 0.10 * _noise(rng, h, w, h // 2, w // 2)[..., None])).clip(0, 1).astype(np.float32)
