"""Figures kept on disk: the same figure again, and no harm from what is not one."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from avatar_fixture import closed_person

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.posture.posture import standing
from vistel.render.figures.cache import cached_figure, figure_of_file
from vistel.render.figures.figures import AvatarFigure, Corners

SHOW = """
import hashlib, sys
from pathlib import Path
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.by_joint import with_joints
from vistel.figure.posture.posture import standing
from vistel.figure.avatar.avatar import Avatar
from vistel.render.figures.cache import cached_figure, figure_of_file
person = cached_figure(builtin_avatar("builtin:person=aiko", name="ann", height=1.7), Path(sys.argv[1]))
touching = person.ghosts(person.pose(standing()).posed, None)
h = hashlib.sha256()
for pixels in (1e9, 300.0, 50.0):
    for bent in ({}, {"left_lower_arm": 100}):
        h.update(person.pose(with_joints(standing(), bent), [touching], pixels).skin.positions.tobytes())
print(h.hexdigest())
"""


def shown(cache: Path) -> str:
    return subprocess.run([sys.executable, "-c", SHOW, str(cache)], capture_output=True, text=True, check=True).stdout


def test_another_process_reads_the_same_figure_to_the_last_bit(tmp_path: Path) -> None:
    made = shown(tmp_path)
    (kept,) = tmp_path.glob("*.figure")
    before = kept.stat().st_ino
    assert shown(tmp_path) == made
    assert kept.stat().st_ino == before  # it was read, not made again


def test_a_damaged_file_is_made_again(tmp_path: Path) -> None:
    avatar = replace(closed_person(), name="ann")
    cached_figure(avatar, tmp_path)
    (kept,) = tmp_path.glob("*.figure")
    kept.write_bytes(kept.read_bytes()[:1000])
    again = cached_figure(avatar, tmp_path).pose(standing()).skin
    assert isinstance(again, Corners)
    assert np.isfinite(again.positions).all()
    assert max(file.stat().st_size for file in tmp_path.glob("*.figure")) > 1_000_000


def test_a_folder_that_cannot_be_used_costs_only_the_keeping(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    avatar = replace(closed_person(), name="ann")
    assert isinstance(cached_figure(avatar, tmp_path / "file" / "figures"), AvatarFigure)


def test_one_file_is_kept_of_an_avatar_made_read_or_shown_before(tmp_path: Path) -> None:
    read = replace(closed_person(), name="ann")
    made = replace(read, albedo=np.asfortranarray(read.albedo), skeleton=replace(read.skeleton, rest=read.skeleton.rest.copy()))
    for avatar in (read, read, made):
        cached_figure(avatar, tmp_path)
    assert len(list(tmp_path.glob("*.figure"))) == 1
    cached_figure(replace(read, skeleton=replace(read.skeleton, rest=read.skeleton.rest * 1.001)), tmp_path)
    assert len(list(tmp_path.glob("*.figure"))) == 2


def test_the_file_of_an_avatar_is_read_only_where_no_figure_of_it_is_kept(tmp_path: Path) -> None:
    file, reads = tmp_path / "ann.npz", list[bool]()

    def read() -> Avatar:
        reads.append(file.exists())
        if not file.exists():
            file.write_bytes(b"as made")
        return replace(closed_person(), name="ann")

    for _ in range(2):
        figure_of_file(file, "ann", read, tmp_path)
    assert reads == [False]
    file.write_bytes(b"as changed")
    figure_of_file(file, "ann", read, tmp_path)
    assert reads == [False, True]
    figure_of_file(tmp_path / "nowhere" / "ann.npz", "ann", read, tmp_path)
    assert len(reads) == 3
