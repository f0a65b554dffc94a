"""The kernel that paints strands of hair."""

# pyright: basic

import math

import numpy as np

from vistel.jit.kernel_jit import compiled


@compiled
def paint_strands(strand, shade, warm, opacity, turn) -> None:
    """Paint strands (N, 13), later ones over earlier ones, on four pictures (H, W). Of each: place across, first and last row, half
    its width, how light and how warm it is, how far it sways [texels], how often and from where on [rad], shares of its length over
    which it grows thick and thin, where it ends across and how far it goes there."""
    height, width = shade.shape
    for n in range(len(strand)):
        x, begin, end, half, light, own, sway, often, phase, thick, thin, aim, clump = strand[n]
        first, last = max(0, int(begin)), min(height - 1, int(end))
        for row in range(first, last + 1):
            s = (row - first) / (last - first)
            at = x + sway * math.sin(phase + 2.0 * math.pi * often * s)
            at += (aim - at) * clump * s * s
            wide = half * min(1.0, (s + 0.02) / thick) * min(1.0, (1.02 - s) / thin)
            middle = math.floor(at)
            for column in range(max(0, middle - 2), min(width, middle + 4)):
                off = column + 0.5 - at
                cover = np.float32(min(1.0, max(0.0, wide - abs(off) + 0.5)))
                if cover <= 0.0:
                    continue
                rounded = min(1.0, max(-1.0, off / max(wide, 0.4)))
                shade[row, column] += cover * (light * (1.0 - 0.22 * rounded * rounded) - shade[row, column])
                warm[row, column] += cover * (own - warm[row, column])
                turn[row, column] += cover * (0.5 * rounded - turn[row, column])
                opacity[row, column] = max(opacity[row, column], cover)
