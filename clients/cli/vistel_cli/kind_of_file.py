"""What a file is, by its first bytes and its content: so that a file given to the wrong command is named."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

HEAD_BYTES = 65536
"""How much of a file is looked at; a TOML file is read whole up to `TOML_BYTES`."""
TOML_BYTES = 8_000_000
"""A larger file is no TOML file of people."""


@dataclass(frozen=True)
class Kind:
    """A kind of file. command: what one can do with it, FILE standing for its name."""

    name: str
    command: str = ""

    def told(self, path: Path) -> str:
        """This is ..., and what to do with it."""
        return f"this is {self.name}" + (f": {self.command.replace('FILE', shlex.quote(str(path)))}" if self.command else "")


MISSING = Kind("missing")
FOLDER = Kind("a folder")
EMPTY = Kind("an empty file")
DATA = Kind("no kind of file that VISTEL knows")
TEXT = Kind("a text of no kind that VISTEL knows")
BROKEN_TOML = Kind("a TOML file with a fault")
CONFERENCE = Kind("a conference file", "vistel up FILE")
SCENE = Kind("a scene file", "vistel trace FILE")
WRINKLES = Kind("a file of wrinkles", "vistel wrinkle wear AVATAR FILE")
SHEET = Kind("a sheet of wrinkles", "vistel wrinkle draw FILE")
SHAPE = Kind("a shape of a wrinkle", "vistel wrinkle show FILE")
PARTS = Kind("a list of parts of a person", "vistel avatar assemble FILE")
GRAMMAR = Kind("a file of words and sentences", "vistel speech grammar FILE")
TOML = Kind("a TOML file of no kind that VISTEL knows")
LOG = Kind("a log of a conference", "vistel log info FILE")
ENCRYPTED = Kind("an encrypted file", "vistel log decrypt FILE --key KEY --out LOG")
USD = Kind("a USD file", "vistel avatar inspect FILE, or vistel world show FILE")
GLTF = Kind("a glTF or VRM file", "vistel avatar import FILE, or vistel world show FILE")
OBJ = Kind("an OBJ mesh", "vistel avatar import FILE, or vistel world show FILE")
PLY = Kind("a PLY mesh")
MHCLO = Kind("clothing of MakeHuman", "vistel avatar import MESH --clothes FILE")
BVH = Kind("recorded motion (BVH)", "vistel up --motion FILE")
C3D = Kind("motion that a laboratory captured (C3D)", "vistel log import FILE")
LEAP = Kind("hands over a Leap Motion", "vistel log import FILE")
VRPN = Kind("a capture of VRPN", "vistel log import FILE")
PICTURE = Kind("a picture", "vistel show FILE")
PDF = Kind("a PDF", "vistel show FILE")
FILM = Kind("a film")
SOUND = Kind("a recording of sound", "vistel speech try FILE")
CSV = Kind("a table (CSV)")
CALIBRATION = Kind("a calibration", "name FILE in a conference file")
JSON = Kind("a JSON file")
ARRAYS = Kind("an archive of arrays (NPZ)")
ARCHIVE = Kind("an archive (ZIP)")
COMPRESSED = Kind("a compressed file (gzip)")

_MAGIC: tuple[tuple[bytes, Kind], ...] = (
    (b"\x89MCAP0\r\n", LOG),
    (b"age-encryption.org/", ENCRYPTED),
    (b"PXR-USDC", USD),
    (b"#usda", USD),
    (b"glTF", GLTF),
    (b"\x89PNG\r\n\x1a\n", PICTURE),
    (b"\xff\xd8\xff", PICTURE),
    (b"%PDF-", PDF),
    (b"GIF8", PICTURE),
    (b"BM", PICTURE),
    (b"II*\0", PICTURE),
    (b"MM\0*", PICTURE),
    (b"\x1a\x45\xdf\xa3", FILM),
    (b"fLaC", SOUND),
    (b"OggS", SOUND),
    (b"ID3", SOUND),
    (b"\x1f\x8b", COMPRESSED),
    (b"ply\n", PLY),
    (b"ply\r\n", PLY),
    (b"HIERARCHY", BVH),
    (b"vrpn: ver. ", VRPN),
    (b"\x02\x50", C3D),
    (b"N4Ig", LEAP),  # a JSON object that LZString has compressed to base64
)
_TABLES: tuple[tuple[set[str], Kind], ...] = (
    ({"parts"}, PARTS),
    ({"sets"}, WRINKLES),
    ({"wrinkles"}, SHEET),
    ({"branches"}, SHAPE),
    ({"classes", "groups", "sentences"}, GRAMMAR),
    ({"sites", "bus", "room"}, CONFERENCE),
    ({"camera", "shapes", "meshes"}, SCENE),
)
"""By which of its keys a TOML file is known."""
TOMLS = tuple(kind for _, kind in _TABLES)
UNSURE = (TOML, BROKEN_TOML)
"""What reads them has more to say."""


def kind_of_file(path: Path) -> Kind:
    """What `path` is. Raises OSError where it cannot be read."""
    if path.is_dir():
        return FOLDER
    if not path.exists():
        return MISSING
    if not path.is_file():
        return DATA  # a port or a pipe: nobody knows how long it is
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
    if not head:
        return EMPTY
    known = next((kind for magic, kind in _MAGIC if head.startswith(magic)), None) or _container(head)
    if known is not None:
        return known
    if path.suffix == ".toml" or b"\0" not in head:
        return _text(path, head)
    return DATA


def _container(head: bytes) -> Kind | None:
    if head[:4] == b"RIFF":
        return {b"WAVE": SOUND, b"WEBP": PICTURE, b"AVI ": FILM}.get(head[8:12])
    if head[4:8] == b"ftyp":
        return FILM
    if head[:4] == b"PK\x03\x04":
        first = head[30 : 30 + int.from_bytes(head[26:28], "little")]
        return USD if first.endswith((b".usda", b".usdc", b".usd")) else ARRAYS if first.endswith(b".npy") else ARCHIVE
    return None


def _text(path: Path, head: bytes) -> Kind:
    try:
        text = head.decode("utf-8-sig", "ignore" if len(head) == HEAD_BYTES else "strict")
    except UnicodeDecodeError:
        return BROKEN_TOML if path.suffix == ".toml" and b"\0" not in head else DATA
    first = text.lstrip()[:1]
    if path.suffix == ".toml" or re.search(r"^\s*(?:\[+\s*[\w\"'. -]+\]+|[\w-]+\s*=)", text, re.MULTILINE):
        found = _toml(path)
        if found is not None:
            return found
    if first == "{" and '"pointables"' in text:
        return LEAP
    if first in ("{", "["):
        return _json(path)
    if re.search(r"^(?:v|f|vn|vt) +-?[\d.]", text, re.MULTILINE):
        return OBJ
    if re.search(r"^(?:uuid|basemesh|obj_file) ", text, re.MULTILINE):
        return MHCLO
    line = text.splitlines()[0] if text.strip() else ""
    return CSV if line.count(",") >= 2 else TEXT


def _toml(path: Path) -> Kind | None:
    import tomllib

    if path.stat().st_size > TOML_BYTES:
        return None
    try:
        tables = tomllib.loads(path.read_text("utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError):
        return BROKEN_TOML if path.suffix == ".toml" else None
    return next((kind for keys, kind in _TABLES if keys & tables.keys()), TOML)


def _json(path: Path) -> Kind:
    try:
        found = json.loads(path.read_text("utf-8-sig")) if path.stat().st_size < TOML_BYTES else {}
    except (ValueError, RecursionError):
        return TEXT
    if isinstance(found, dict) and "asset" in found and "meshes" in found:
        return GLTF
    return (
        CALIBRATION
        if isinstance(found, dict) and str(cast("dict[str, Any]", found).get("format", "")).startswith("vistel")
        else JSON
    )
