"""Pictures of textures: of every kind that cameras and programs write, huge ones, damaged ones."""

from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from vistel.figure.making import pictures
from vistel.figure.making.pictures import decode
from vistel.figure.making.source import MakingError

RED, GREEN = (200, 10, 10), (0, 150, 0)


def two_tone(width: int, height: int) -> Image.Image:
    """Red above, green below."""
    out = Image.new("RGB", (width, height), RED)
    out.paste(GREEN, (0, height // 2, width, height))
    return out


def encoded(image: Image.Image, kind: str = "PNG", **options: object) -> bytes:
    out = io.BytesIO()
    image.save(out, kind, **options)
    return out.getvalue()


@pytest.mark.parametrize(
    ("mode", "kind"), [("RGB", "PNG"), ("RGBA", "PNG"), ("P", "PNG"), ("RGB", "JPEG"), ("CMYK", "JPEG"), ("RGB", "TIFF")]
)
def test_every_kind_shows_its_colours(mode: str, kind: str) -> None:
    back = decode(encoded(two_tone(64, 32).convert(mode, palette=Image.Palette.ADAPTIVE), kind))
    assert back.shape == (32, 64, 3)
    assert np.abs(back[4, 8].astype(int) - RED).max() < 8
    assert np.abs(back[28, 8].astype(int) - GREEN).max() < 8


def test_sixteen_bits_of_grey_keep_their_shades() -> None:
    ramp = np.tile(np.linspace(0, 65535, 64).astype(np.uint16), (8, 1))
    back = decode(encoded(Image.fromarray(ramp)))
    assert back.shape == (8, 64, 3)
    assert back[0, 0, 0] == 0 and back[0, 63, 0] == 255
    assert abs(int(back[0, 32, 0]) - 129) < 4


def test_one_texel_is_a_picture() -> None:
    assert decode(encoded(Image.new("RGB", (1, 1), RED))).tolist() == [[list(RED)]]


def test_what_fits_stays_as_it_is_and_reports_nothing() -> None:
    image = Image.fromarray(np.random.default_rng(2).integers(0, 256, (70, 90, 3)).astype(np.uint8))
    notes: list[str] = []
    assert np.array_equal(decode(encoded(image), notes=notes), np.asarray(image))
    assert notes == []


@pytest.mark.parametrize("kind", ["PNG", "JPEG"])
def test_a_huge_one_is_made_smaller_with_a_line(kind: str) -> None:
    notes: list[str] = []
    back = decode(encoded(two_tone(3000, 9000), kind), 512, notes=notes, name="texture wall.png")
    assert back.shape == (512, 171, 3)
    assert notes == ["texture wall.png: 3000 by 9000, made 171 by 512"]
    assert np.abs(back[100, 80].astype(int) - RED).max() < 8 and np.abs(back[400, 80].astype(int) - GREEN).max() < 8


def test_more_than_pillow_takes_is_read_and_more_than_that_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    data = encoded(two_tone(200, 1200))
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100_000)
    assert decode(data).shape == (1200, 200, 3)
    assert Image.MAX_IMAGE_PIXELS == 100_000
    monkeypatch.setattr(pictures, "MOST_TEXELS", 100_000)
    with pytest.raises(MakingError, match="200 by 1200, expected at most"):
        decode(data)


@pytest.mark.filterwarnings("ignore::UserWarning")
@settings(max_examples=60, deadline=None)
@given(cut=st.integers(0, 400), at=st.integers(0, 400), value=st.integers(0, 255), kind=st.sampled_from(["PNG", "JPEG", "TIFF"]))
def test_damage_is_one_line_and_never_a_crash(cut: int, at: int, value: int, kind: str) -> None:
    data = bytearray(encoded(two_tone(20, 16), kind))
    data[at % len(data)] = value
    try:
        assert decode(bytes(data[: max(0, len(data) - cut)])).shape[2] == 3
    except MakingError as fault:
        assert "\n" not in str(fault)
