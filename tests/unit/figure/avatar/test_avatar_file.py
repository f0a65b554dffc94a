"""Avatars on file: the cache and the export."""

import logging
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from figure_fixture import tube_person
from PIL import Image

from vistel.figure.avatar.check import AvatarFileError
from vistel.figure.formats.avatar_file import load_avatar, save_avatar
from vistel.figure.formats.obj import export_obj
from vistel.figure.people import builtin as avatar_builtin


@pytest.fixture
def person():
    made = tube_person()
    albedo = np.random.default_rng(1).integers(0, 255, (16, 16, 3), dtype=np.uint8)
    eye = replace(made.mesh, vertices=made.mesh.vertices * np.float32(0.01))
    return replace(made, name="anna", albedo=albedo, eyeballs=(eye, eye))


def same(a, b):
    assert a.name == b.name and a.body.names == b.body.names and len(a.eyeballs) == len(b.eyeballs)
    for one, two in ((a.skeleton, b.skeleton), (a.body, b.body), (a.mesh, b.mesh), *zip(a.eyeballs, b.eyeballs, strict=True)):
        for field in one.__dataclass_fields__:
            left, right = getattr(one, field), getattr(two, field)
            if isinstance(left, np.ndarray):
                assert left.dtype == right.dtype and np.array_equal(left, right)
    assert np.array_equal(a.albedo, b.albedo)


def test_a_saved_avatar_comes_back_whole(person, tmp_path):
    save_avatar(person, tmp_path / "anna.npz")
    same(load_avatar(tmp_path / "anna.npz"), person)
    assert [p.name for p in tmp_path.iterdir()] == ["anna.npz"]


@pytest.mark.parametrize(
    "damage", [lambda b: b[: len(b) // 2], lambda b: b"", lambda b: b"PK\x03\x04" + b[4:200], lambda b: b"x" * 50]
)
def test_a_damaged_file_is_named_not_loaded(person, tmp_path, damage):
    path = tmp_path / "anna.npz"
    save_avatar(person, path)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(AvatarFileError, match=r"anna\.npz"):
        load_avatar(path)


def test_a_flipped_byte_is_noticed_or_harmless(person, tmp_path):
    path = tmp_path / "anna.npz"
    save_avatar(person, path)
    whole = path.read_bytes()
    rng = np.random.default_rng(2)
    noticed = 0
    for at in rng.integers(0, len(whole), 60):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x55]) + whole[at + 1 :])
        try:
            read = load_avatar(path)
        except AvatarFileError:
            noticed += 1
        else:
            same(read, person)
    assert noticed > 50  # nearly all bytes are numbers


@pytest.fixture
def made(person, monkeypatch):
    """Counts how often a person is made; making is cut short, what is tested here is the cache round it."""
    calls = []

    def make(who, name):
        calls.append(who)
        return replace(person, name=name)

    monkeypatch.setattr(avatar_builtin.body_model, "make", make)
    return calls


def test_the_second_call_reads_the_cache(made, tmp_path):
    first = avatar_builtin.builtin_avatar("builtin:seed=1", name="anna", height=1.7, cache=tmp_path / "new" / "folder")
    second = avatar_builtin.builtin_avatar("builtin:seed=1", name="berta", height=1.7, cache=tmp_path / "new" / "folder")
    assert len(made) == 1
    assert second.name == "berta"
    assert np.array_equal(first.mesh.vertices, second.mesh.vertices)
    avatar_builtin.builtin_avatar("builtin:seed=1", name="anna", height=1.8, cache=tmp_path / "new" / "folder")
    avatar_builtin.builtin_avatar("builtin:seed=2", name="anna", height=1.7, cache=tmp_path / "new" / "folder")
    assert len(made) == 3


def test_a_damaged_cache_costs_one_log_line(made, tmp_path, caplog):
    avatar_builtin.builtin_avatar("builtin:seed=1", name="anna", height=1.7, cache=tmp_path)
    next(tmp_path.glob("person-*.npz")).write_bytes(b"rubbish")
    with caplog.at_level(logging.INFO):
        avatar_builtin.builtin_avatar("builtin:seed=1", name="anna", height=1.7, cache=tmp_path)
    assert len(made) == 2
    assert [r.message.split()[0] for r in caplog.records] == ["event=avatar_cache_unreadable"]
    avatar_builtin.builtin_avatar("builtin:seed=1", name="anna", height=1.7, cache=tmp_path)
    assert len(made) == 2


def test_an_unwritable_cache_costs_one_log_line(made, tmp_path, caplog):
    (tmp_path / "occupied").write_text("a file where the folder should be")
    with caplog.at_level(logging.INFO):
        person = avatar_builtin.builtin_avatar("builtin:seed=1", name="anna", height=1.7, cache=tmp_path / "occupied")
    assert person.name == "anna"
    assert [r.message.split()[0] for r in caplog.records] == ["event=avatar_cache_unwritable"]


def test_the_cache_lies_where_the_user_says(monkeypatch, tmp_path):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert avatar_builtin.default_cache() == tmp_path / "vistel" / "avatars"


def test_an_exported_obj_holds_shape_and_texture(person, tmp_path):
    export_obj(person, tmp_path / "anna.obj")
    scene = trimesh.load(tmp_path / "anna.obj", force="scene", process=False)
    faces = sum(len(g.faces) for g in scene.geometry.values())
    assert faces == len(person.mesh.triangles) + sum(len(e.triangles) for e in person.eyeballs)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "anna.png")), person.albedo)
    assert "map_Kd anna.png" in (tmp_path / "anna.mtl").read_text()
