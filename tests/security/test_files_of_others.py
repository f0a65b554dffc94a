"""A file of somebody else, which an honest person opens: a log, a mesh, a room; and another user of the machine."""

from __future__ import annotations

import io
import json
import os
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk
from PIL import Image

from vistel.figure.making.files.gltf import read_document
from vistel.figure.making.files.read_obj import read_obj
from vistel.figure.making.files.read_usd import read_usd
from vistel.figure.making.source import MakingError
from vistel.wire.log_index import MOST_UNPACKED_BYTES, BrokenLogError, ChunkPlace, open_chunk
from vistel.wire.shared_pictures import PictureWriter

OBJ = """mtllib {material}
v 0 0 0
v 1 0 0
v 0 1 0
vt 0 0
usemtl skin
f 1/1 2/1 3/1
"""
USD = """#usda 1.0
(
  upAxis = "Y"
  metersPerUnit = 1
  {sub}
)
def Xform "Root" {{
  def Mesh "Body" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    rel material:binding = </Root/M>
  }}
  def Material "M" {{
    token outputs:surface.connect = </Root/M/S.outputs:surface>
    def Shader "S" {{
      uniform token info:id = "UsdPreviewSurface"
      color3f inputs:diffuseColor.connect = </Root/M/T.outputs:rgb>
      token outputs:surface
    }}
    def Shader "T" {{
      uniform token info:id = "UsdUVTexture"
      asset inputs:file = @{picture}@
      float3 outputs:rgb
    }}
  }}
}}
"""


@pytest.fixture
def private(tmp_path: Path) -> Path:
    """A picture that is no business of who sends a file, and the folder where that file lies."""
    Image.fromarray(np.full((8, 8, 3), 200, np.uint8)).save(tmp_path / "private.png")
    (tmp_path / "private.mtl").write_text("newmtl skin\nKd 1 0 0\n")
    (tmp_path / "private.usda").write_text("#usda 1.0\n")
    (tmp_path / "sent").mkdir()
    (tmp_path / "sent" / "link.png").symlink_to(tmp_path / "private.png")
    return tmp_path


@pytest.mark.parametrize("name", ["../private.png", "{folder}/private.png", "link.png"])
def test_no_picture_outside_its_folder_is_read_for_a_usd_file(private: Path, name: str) -> None:
    file = private / "sent" / "mesh.usda"
    file.write_text(USD.format(sub="", picture=name.format(folder=private)))
    source = read_usd(file)
    assert all(m.picture is None for m in source.materials)
    assert any("expected a file beside it" in note for note in source.notes)
    Image.open(private / "private.png").save(private / "sent" / "own.png")
    file.write_text(USD.format(sub="", picture="own.png"))
    assert any(m.picture is not None for m in read_usd(file).materials), "its own is"


def test_no_usd_file_is_composed_of_files_outside_its_folder(private: Path) -> None:
    file = private / "sent" / "mesh.usda"
    file.write_text(USD.format(sub="subLayers = [@../private.usda@]", picture=""))
    with pytest.raises(MakingError, match="expected a file beside it"):
        read_usd(file)


@pytest.mark.parametrize("name", ["../private.png", "{folder}/private.png", "link.png"])
def test_no_picture_outside_its_folder_is_read_for_an_obj_or_gltf_file(private: Path, name: str) -> None:
    name = name.format(folder=private)
    (private / "sent" / "own.mtl").write_text(f"newmtl skin\nmap_Kd {name}\n")
    file = private / "sent" / "mesh.obj"
    file.write_text(OBJ.format(material="own.mtl"))
    source = read_obj(file)
    assert all(m.picture is None for m in source.materials)
    assert any("expected a file beside it" in note for note in source.notes)
    gltf = private / "sent" / "mesh.gltf"
    gltf.write_text(json.dumps({"asset": {"version": "2.0"}, "buffers": [{"uri": name, "byteLength": 8}]}))
    with pytest.raises(MakingError, match="expected a file beside it"):
        read_document(gltf)._uri(name)


def test_no_material_file_outside_its_folder_is_read(private: Path) -> None:
    file = private / "sent" / "mesh.obj"
    file.write_text(OBJ.format(material="../private.mtl"))
    assert any("expected a file beside it" in note for note in read_obj(file).notes)


def chunk_of(data: bytes, says: int, compression: str) -> io.BytesIO:
    builder = RecordBuilder()
    Chunk(compression, data, 0, 0, 0, says).write(builder)
    return io.BytesIO(builder.end())


@pytest.mark.parametrize("says", [100, MOST_UNPACKED_BYTES + 1, 2**63])
@pytest.mark.parametrize("compression", ["lz4", "zstd", ""])
def test_a_small_chunk_of_a_log_that_unpacks_into_much_is_broken(compression: str, says: int) -> None:
    much = bytes(64 << 20)
    packed = {"lz4": lz4.frame.compress, "zstd": zstandard.compress, "": lambda data: data[:200]}[compression](much)
    with pytest.raises(BrokenLogError, match=r"it (claims to have|is not of the)"):
        open_chunk(chunk_of(packed, says, compression), ChunkPlace(0, 0, 0))


@pytest.mark.parametrize("compression", ["lz4", "zstd", ""])
def test_a_chunk_that_says_how_large_it_is_is_read(compression: str) -> None:
    data = b"\x7f" + (1).to_bytes(8, "little") + b"x"
    packed = {"lz4": lz4.frame.compress, "zstd": zstandard.compress, "": bytes}[compression](data)
    assert open_chunk(chunk_of(packed, len(data), compression), ChunkPlace(0, 0, 0)) == []


def test_what_another_user_put_where_shared_pictures_are_made_is_neither_followed_nor_written(tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_text("all of it")
    memory = tmp_path / "memory"
    memory.mkdir()
    for name in ("vistel-demo-tokyo", f"vistel-demo-tokyo.{os.getpid()}"):
        (memory / name).symlink_to(precious)
    writer = PictureWriter(memory / "vistel-demo-tokyo", 4, 4)
    writer.close()
    assert precious.read_text() == "all of it"
