"""Pictures of the documentation keep all their colours: 256 of them make red blotches and bands on faces."""

from __future__ import annotations

from pathlib import Path

import pytest

PICTURES = Path(__file__).resolve().parents[2] / "docs" / "pictures"
DIAGRAMS = {
    "embedding-fit",
    "figure-01-primitives",
    "figure-17-pointblob",
    "figure-18-blended-pointblobs",
    "figure-19-point-setblob",
    "figure-21-local-control",
    "figure-22-blends",
    "placement",
    "polygonise-cells",
    "polygonise-kept",
    "polygonise-sculpting",
    "wrinkle-shapes",
}
"""Shapes in one plain colour, meshes coloured by what they belong to, curves and sections."""
MOST_BYTES = 1_500_000
_COLOUR_TYPE, _PALETTE = 25, 3


@pytest.mark.parametrize("path", sorted(PICTURES.rglob("*.png")), ids=lambda p: p.stem)
def test_a_rendered_picture_has_no_palette_and_is_not_larger_than_a_page_can_bear(path: Path) -> None:
    head = path.read_bytes()[: _COLOUR_TYPE + 1]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    assert head[_COLOUR_TYPE] != _PALETTE or path.stem in DIAGRAMS
    assert path.stat().st_size <= MOST_BYTES


def test_what_is_called_a_diagram_is_there() -> None:
    assert {p.stem for p in PICTURES.rglob("*.png")} >= DIAGRAMS
