"""Pictures on the graphics side."""

import logging

import cv2
import moderngl
import numpy as np

from vistel.arrays import U8

log = logging.getLogger("vistel.renderer")


def texture_of(ctx: moderngl.Context, image: U8, software: bool, at_most: int = 8192, *, mipmaps: bool = True) -> moderngl.Texture:
    """A texture of `image` (h, w), (h, w, 3) or (h, w, 4), first row at the top, reduced to `at_most` texels each way; to fewer,
    which is logged, where OpenGL takes no more. Without mipmaps it is meant to be seen in its own size and ends at its edges."""
    takes = int(ctx.info["GL_MAX_TEXTURE_SIZE"])
    step = -(-max(image.shape[:2]) // min(at_most, takes))
    if takes < min(at_most, max(image.shape[:2])):
        log.warning("event=picture_reduced width=%d height=%d by=%d opengl_takes=%d", image.shape[1], image.shape[0], step, takes)
    if step > 1:
        size = -(-image.shape[1] // step), -(-image.shape[0] // step)
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    if software and mipmaps and (channels := (*image.shape, 1)[2]) < 4:
        # In software, OpenGL compiles what makes mipmaps for each format, which takes longer than everything else here.
        image = with_alpha(image, channels)
    flipped = np.ascontiguousarray(image[::-1])
    h, w, components = (*flipped.shape, 1)[:3]
    texture = ctx.texture((w, h), components, flipped.tobytes(), alignment=1)
    if mipmaps:
        texture.build_mipmaps()
        nearest = moderngl.LINEAR_MIPMAP_NEAREST if software else moderngl.LINEAR_MIPMAP_LINEAR
        texture.filter = (nearest, moderngl.LINEAR)
        if not software:
            texture.anisotropy = 8.0
    else:
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
    return texture


def rewritten(texture: moderngl.Texture, image: U8) -> bool:
    """Give a texture of `texture_of` with mipmaps another image (h, w, 3); False where that needs a new one, of another size."""
    if (texture.width, texture.height) != (image.shape[1], image.shape[0]):
        return False
    whole = with_alpha(image, 3) if texture.components == 4 else image
    texture.write(np.ascontiguousarray(whole[::-1]).tobytes(), alignment=1)
    texture.build_mipmaps()
    return True


def with_alpha(image: U8, channels: int) -> U8:
    """An image (h, w) or (h, w, 3) as (h, w, 4)."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGBA if channels == 1 else cv2.COLOR_RGB2RGBA), np.uint8)
