"""Scanline pictures of implicit surfaces (Singh §3.3.3, appendix A).

    from vistel.implicit.scanline import Scanline, render
    from vistel.implicit.scene import load, write_png

    write_png("out.png", render(load("scene.toml")).light)

    line = Scanline(scene)               # to edit: only the pixels of changed primitives are drawn again
    before, after = line.draw(), line.edit(shape)

See docs/how-to/trace-a-scene.md.
"""

from vistel.implicit.scanline.renderer import Scanline, ScanlinePicture, render

__all__ = ["Scanline", "ScanlinePicture", "render"]
