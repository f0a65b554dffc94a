"""Where a picture stands in a window."""

from __future__ import annotations

from vistel.render.view.screens import Box


def fitted(part: Box, size: tuple[int, int], squeezed: bool = False) -> Box:
    """Where in a window of `size` a picture's part is shown as large as fits, its shape kept. squeezed: it holds two eyes'
    pictures of full width side by side, each of which gets half the window's."""
    _, _, w, h = part
    w = w // 2 if squeezed else w
    scale = min(size[0] / w, size[1] / h)
    width, height = round(w * scale), round(h * scale)
    return (size[0] - width) // 2, (size[1] - height) // 2, width, height
