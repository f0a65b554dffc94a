"""Guests by a link in a browser: how soon they are in the room, how late their figures follow, and what ten of them cost.

A film is the camera of a headless Chromium; ten guests without a browser send what pages send. Where the processor draws in place
of a graphics card, times that hang on drawing are given and not judged.
"""

from collections.abc import Iterator

from benchmarks.pages import guest_page, guests_live
from benchmarks.row import Row


def run() -> Iterator[Row]:
    """Ten guests, then one page."""
    yield from guests_live.rows()
    yield from guest_page.rows()
