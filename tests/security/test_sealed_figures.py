"""Somebody changes figures where they are kept: their numbers are indices and addresses to kernels, so not one may be believed."""

from __future__ import annotations

import json
import logging
import math
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from avatar_fixture import long_armed
from hypothesis import given
from hypothesis import strategies as st

from vistel.arrays import F32
from vistel.figure.posture.posture import standing
from vistel.implicit.deformation import deform_table as table
from vistel.render.figures.cache import KEPT, cached_figure
from vistel.render.figures.figures import Corners
from vistel.render.figures.seal import own_key, seal, unsealed

Bytes = np.ndarray[Any, np.dtype[np.uint8]]
NAME = "0123456789abcdef"
KEY = bytes(range(32))


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a real figure, small: one level of detail."""
    folder = tmp_path_factory.mktemp("kept")
    cached_figure(long_armed(), folder)
    (file,) = folder.glob(f"*{KEPT}")
    return file


@pytest.fixture(scope="module")
def whole(kept: Path) -> Bytes:
    """What is in it, without its seal."""
    key = own_key()
    assert key is not None
    body = unsealed(key, kept.stem, np.fromfile(kept, np.uint8))
    assert body is not None
    return body


def positions(folder: Path) -> F32:
    skin = cached_figure(long_armed(), folder).pose(standing()).skin
    assert isinstance(skin, Corners)
    return skin.positions.copy()


def state_of(values: list[Any], cls: str) -> dict[str, int]:
    """Where the attributes of the first object of a class are among the values."""
    told = next(v for v in values if type(v) is list and v[0] == "object" and v[2] == cls)
    return dict(zip(told[3::2], told[4::2], strict=True))


def changed(body: Bytes, change: Callable[[list[Any], Callable[[int], Any]], None]) -> Bytes:
    """The bytes with other values: change(values, numbers of an array by its place among them)."""
    out = body.copy()
    end = 25 + int.from_bytes(out[17:25].tobytes(), "little")
    root, values = json.loads(out[25:end].tobytes())

    def numbers(at: int) -> Any:
        _, form, begin, *shape = values[at]
        return np.frombuffer(out, form, math.prod(shape), end + begin)

    change(values, numbers)
    head = json.dumps([root, values], separators=(",", ":")).encode()
    assert len(head) <= end - 25
    out[25:end] = np.frombuffer(head.ljust(end - 25), np.uint8)
    return out


def an_index_beyond_its_array(values: list[Any], numbers: Callable[[int], Any]) -> None:
    numbers(state_of(values, "Rows")["index"])[:] = 1 << 29


def an_address_of_the_attackers_choice(values: list[Any], numbers: Callable[[int], Any]) -> None:
    deformer = state_of(values, "Deformer")
    told = values[deformer["_arrays"]]
    pairs = zip(told[1::2], told[2::2], strict=True)
    # Who reads the file asks for these: without them it would end there already.
    asked = [pair for pair in pairs if values[pair[0]] in (table.INDEX, table.CALIBRATION)]
    values[deformer["_arrays"]] = ["dict", *(n for pair in asked for n in pair)]
    numbers(deformer["_table"])[:] = 4096


SHOW = """
import sys
import numpy as np
from vistel.figure.posture.posture import standing
from vistel.render.figures.figures import AvatarFigure
from vistel.render.figures.object_file import from_bytes
person = from_bytes(np.fromfile(sys.argv[1], np.uint8))
person.pose(standing(), [person.ghosts(person.pose(standing()).posed, None)])
"""


@pytest.mark.parametrize("change", [an_index_beyond_its_array, an_address_of_the_attackers_choice])
def test_a_changed_figure_ends_a_process_that_believes_it_and_is_made_again_by_ours(
    change: Callable[[list[Any], Callable[[int], Any]], None],
    kept: Path,
    whole: Bytes,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    bad = changed(whole, change)
    bad.tofile(tmp_path / "believed")
    believed = subprocess.run([sys.executable, "-c", SHOW, str(tmp_path / "believed")], capture_output=True, check=False)
    assert believed.returncode < 0  # by a signal

    written = np.fromfile(kept, np.uint8)
    written[: len(bad)] = bad
    written.tofile(file := tmp_path / kept.name)
    file.chmod(0o600)
    with caplog.at_level(logging.WARNING, "vistel.renderer"):
        again = positions(tmp_path)
    assert [r.getMessage().split(" path")[0] for r in caplog.records] == ["event=figure_damaged"]
    np.testing.assert_array_equal(again, positions(kept.parent))
    caplog.clear()
    np.testing.assert_array_equal(positions(tmp_path), again)  # from a good file now
    assert not caplog.records


@given(st.data())
def test_no_changed_byte_of_a_kept_figure_is_believed(whole: Bytes, data: st.DataObject) -> None:
    sealed = np.concatenate([whole, np.frombuffer(seal(KEY, NAME, [whole.data]), np.uint8)])
    for _ in range(data.draw(st.integers(1, 4))):
        sealed[data.draw(st.integers(0, len(sealed) - 1))] ^= data.draw(st.integers(1, 255))
    same = np.array_equal(sealed[: len(whole)], whole)
    back = unsealed(KEY, NAME, sealed)
    assert back is None or (same and np.array_equal(back, whole))  # two changes of one byte may cancel


@given(st.integers(0, 1 << 20), st.binary(min_size=1, max_size=64))
def test_a_figure_that_is_cut_or_has_more_behind_it_is_not_believed(whole: Bytes, cut: int, more: bytes) -> None:
    body = whole[: 1 << 20]
    sealed = np.concatenate([body, np.frombuffer(seal(KEY, NAME, [body.data]), np.uint8)])
    assert unsealed(KEY, NAME, sealed) is not None
    assert unsealed(KEY, NAME, sealed[:cut]) is None
    assert unsealed(KEY, NAME, np.concatenate([sealed, np.frombuffer(more, np.uint8)])) is None


def test_the_figure_of_somebody_else_is_not_read_under_this_name(kept: Path, tmp_path: Path) -> None:
    other = replace(long_armed(), albedo=np.full_like(long_armed().albedo, 200))
    cached_figure(other, tmp_path)
    (file,) = tmp_path.glob(f"*{KEPT}")
    shutil.copy(kept, file)
    assert (cached_figure(other, tmp_path).pose(standing()).model.texture == 200).all()


def test_seals_are_of_one_key_and_one_name() -> None:
    body = np.arange(100, dtype=np.uint8)
    sealed = np.concatenate([body, np.frombuffer(seal(KEY, NAME, [body[:40].data, body[40:].data]), np.uint8)])
    assert unsealed(KEY, NAME, sealed) is not None
    assert unsealed(KEY[::-1], NAME, sealed) is None
    assert unsealed(KEY, NAME[::-1], sealed) is None
    assert unsealed(KEY, "", np.concatenate([np.frombuffer(NAME.encode(), np.uint8), sealed])) is None


def test_processes_that_begin_at_once_have_one_key_which_nobody_else_can_read(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as several:
        keys = list(several.map(lambda _: own_key(tmp_path / "state"), range(32)))
    assert len(set(keys)) == 1 and keys[0] is not None and len(keys[0]) == 32
    assert (tmp_path / "state" / "figures.key").stat().st_mode & 0o077 == 0


def test_a_key_that_others_could_read_or_that_is_none_is_replaced(tmp_path: Path) -> None:
    before = own_key(tmp_path)
    (tmp_path / "figures.key").chmod(0o644)
    after = own_key(tmp_path)
    assert after not in (before, None)
    (tmp_path / "figures.key").write_bytes(b"")
    assert own_key(tmp_path) not in (after, b"", None)


def test_without_a_place_for_the_key_figures_are_made_and_none_is_kept_or_read(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in the way").touch()
    monkeypatch.setattr("vistel.render.figures.seal.default_state", lambda: tmp_path / "in the way")
    np.testing.assert_array_equal(positions(tmp_path), positions(kept.parent))
    assert list(tmp_path.glob(f"*{KEPT}")) == []
