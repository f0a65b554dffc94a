"""Guests by a link: how soon they are in the room, how late their figures follow a webcam, what ten of them cost, slides and ink.

A film is the camera of a headless Chromium; guests without a browser send what pages send. Finding a body in a picture takes
seconds where the processor does it in place of a graphics card; it is told apart, and the sum is judged only where it is quick.
"""

from collections.abc import Iterator, Sequence

from benchmarks.pages import guest_cost, guest_ink, guest_lag, guest_page, guest_slides
from benchmarks.parts import rows_of
from benchmarks.row import Row

PARTS = {"page": guest_page.rows, "lag": guest_lag.rows, "ten": guest_cost.rows, "slides": guest_slides.rows, "ink": guest_ink.rows}


def run(parts: Sequence[str] = ()) -> Iterator[Row]:
    """One page in a browser; guests without one. parts: names of those that are wanted; none: all."""
    yield from rows_of(PARTS, parts)
