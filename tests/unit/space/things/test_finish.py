"""How things from files shine: roughness and metallic of glTF and USD come to what is drawn, travel and are written again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial

from vistel.figure.making.files.read_gltf import read_gltf
from vistel.figure.making.files.read_usd import read_usd
from vistel.figure.making.source import Finish, SourceMaterial
from vistel.space.files import Interior, Polymesh, load_room, save_usd
from vistel.space.files.gltf_write import save_glb
from vistel.space.files.surfaces import PLAIN, pieces_of
from vistel.space.files.travel import pack_model, unpack_model
from vistel.space.room import Room, meeting_room
from vistel.space.things.things import Look

STEEL = Finish(0.2, 1.0)


def glb(path: Path, material: PBRMaterial) -> Path:
    mesh = trimesh.creation.box((0.2, 0.2, 0.2))
    uv = np.zeros((len(mesh.vertices), 2))
    mesh.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    path.write_bytes(trimesh.Scene(mesh).export(file_type="glb"))
    return path


def model(*materials: SourceMaterial) -> Polymesh:
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], np.float32) * 0.1
    faces = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], np.int32)
    numbers = np.arange(4, dtype=np.int32) % len(materials)
    return Polymesh(corners, faces, np.zeros((0, 2), np.float32), np.full((4, 3), -1, np.int32), numbers, materials)


def finishes(materials: tuple[SourceMaterial, ...]) -> set[Finish | None]:
    return {m.finish for m in materials if m.name}


def test_factors_of_gltf(tmp_path: Path) -> None:
    steel = PBRMaterial(name="steel", roughnessFactor=0.2, metallicFactor=1.0, baseColorFactor=(200, 200, 210, 255))
    assert finishes(read_gltf(glb(tmp_path / "a.glb", steel)).materials) == {STEEL}


def test_a_texture_of_gltf_counts_by_its_mean(tmp_path: Path) -> None:
    # Green is roughness, blue is metallic.
    texture = Image.fromarray(np.full((4, 4, 3), (0, 128, 51), np.uint8))
    told = PBRMaterial(name="worn", roughnessFactor=0.5, metallicFactor=1.0, metallicRoughnessTexture=texture)
    (found,) = finishes(read_gltf(glb(tmp_path / "a.glb", told)).materials)
    assert found is not None
    assert (found.roughness, found.metallic) == pytest.approx((0.251, 0.2), abs=0.01)


USD = """#usda 1.0
(
    defaultPrim = "A"
    metersPerUnit = 1
    upAxis = "Y"
)
def Xform "A"
{
    def Mesh "M" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        int[] faceVertexCounts = [3, 3, 3, 3]
        int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        rel material:binding = </A/Steel>
    }
    def Material "Steel"
    {
        token outputs:surface.connect = </A/Steel/S.outputs:surface>
        def Shader "S"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.5, 0.5, 0.5)
            %s
            token outputs:surface
        }
    }
}
"""


@pytest.mark.parametrize(
    ("said", "found"),
    [
        ("float inputs:roughness = 0.2\nfloat inputs:metallic = 1", STEEL),
        ("", Finish(0.5, 0.0)),
        ("float inputs:roughness = 7\nfloat inputs:metallic = -3", Finish(1.0, 0.0)),
        ("float inputs:roughness = nan", None),
    ],
)
def test_inputs_of_usd_preview_surface(said: str, found: Finish | None, tmp_path: Path) -> None:
    (tmp_path / "a.usda").write_text(USD % said)
    assert finishes(read_usd(tmp_path / "a.usda").materials) == {found}


def test_it_travels_and_is_part_of_what_a_polymesh_is() -> None:
    plain, steel = model(SourceMaterial("a", (9, 9, 9))), model(SourceMaterial("a", (9, 9, 9), None, STEEL))
    assert plain.digest != steel.digest
    back = unpack_model(pack_model(steel), steel.digest, {})
    assert back.materials[0].finish == STEEL
    assert unpack_model(pack_model(plain), plain.digest, {}).materials[0].finish is None


def test_a_room_keeps_it_and_writes_it_for_other_programs(tmp_path: Path) -> None:
    shape = model(SourceMaterial("steel", (200, 200, 210), None, STEEL), SourceMaterial("chalk", (250, 250, 250)))
    room = meeting_room(2)
    hidden = tuple(replace(p, colour=0x80808000) for p in room.thing("box").primitives)
    box = replace(room.thing("box"), primitives=hidden, looks=(Look(shape.digest),))
    things = (*room.things[:2], box)
    interior = Interior(Room(room.seats, things, shell=False)).with_things(things, {shape.digest: shape})
    save_usd(interior, tmp_path / "room.usda")
    back = load_room(tmp_path / "room.usda")
    assert [m.finish for m in back.models[shape.digest].materials] == [STEEL, None]
    drawn = [p.finish for p in pieces_of(back.room.thing("box"), back.models) if p.mesh]
    assert drawn == [STEEL, PLAIN]
    save_glb(back, tmp_path / "room.glb")
    assert STEEL in finishes(tuple(replace(m, name="m") for m in read_gltf(tmp_path / "room.glb").materials))
