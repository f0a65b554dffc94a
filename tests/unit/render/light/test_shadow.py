"""The shadow map: what does not move is drawn once, and is in it all the same."""

import numpy as np
import pytest

from vistel.render.light.shadow import ShadowMap

SIZE = 64


@pytest.fixture(scope="module")
def shadow(surface):
    return ShadowMap(surface.ctx, SIZE)


def _plate(shadow, x, y, z, half=0.3):
    """A square lying in the room, seen from above."""
    corners = np.array([(x + a * half, y, z + b * half) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))], np.float32)
    vertices = shadow.ctx.buffer(corners.tobytes())
    return shadow.solid(vertices, "3f", shadow.ctx.buffer(np.array((0, 2, 1, 0, 3, 2), np.int32).tobytes()))


def _depth(shadow):
    return np.frombuffer(shadow.texture.read(), np.float32).reshape(SIZE, SIZE)


def test_what_is_kept_stands_in_the_map_as_if_it_were_drawn_each_time(shadow):
    table, ball, here = _plate(shadow, 0.0, 0.7, 0.0, 0.6), _plate(shadow, 0.1, 1.0, 0.2), np.eye(4, dtype=np.float32)
    shadow.keep([])
    shadow.draw([], [(here, table), (here, ball)])
    whole = _depth(shadow)
    shadow.keep([table])
    for _ in range(2):
        shadow.draw([], [(here, ball)])
        assert np.array_equal(_depth(shadow), whole)
    shadow.draw([], [])
    assert not np.array_equal(_depth(shadow), whole), "what moved away leaves no shadow"


def test_other_things_that_are_kept_take_the_place_of_the_ones_before(shadow):
    one, other = _plate(shadow, -0.6, 0.7, 0.0), _plate(shadow, 0.6, 0.7, 0.0)
    seen = []
    for kept in ([one], [other], [one], [one, other], []):
        shadow.keep(kept)
        shadow.draw([], [])
        seen.append(_depth(shadow))
    assert np.array_equal(seen[0], seen[2])
    empty = seen[4].max()
    assert (seen[4] == empty).all()
    covered = [int((depth < empty).sum()) for depth in seen[:4]]
    assert covered[0] > 50
    assert covered[1] > 50
    assert covered[3] == covered[0] + covered[1]
