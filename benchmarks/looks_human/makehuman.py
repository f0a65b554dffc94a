"""MakeHuman's own man and woman, clothed, as peers: its base mesh, rig, skin and suit under ../shared/data, imported as anybody's
are."""

from pathlib import Path

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.making.files.read import Extras, read_source
from vistel.figure.making.make import make_avatar

_DATA = Path(__file__).resolve().parents[3] / "shared/data/human/makehuman"
PEERS = ("MakeHuman's man", "MakeHuman's woman")
_HEIGHT = {"man": 1.78, "woman": 1.66}


def has_peers() -> bool:
    """Whether MakeHuman's files are here."""
    return (_DATA / "base.obj").is_file()


def peer(name: str) -> Avatar:
    """One of PEERS. Raises OSError or MakingError."""
    who = "woman" if name == PEERS[1] else "man"
    extras = Extras(
        texture=_DATA / "skins/young_lightskinned_male_diffuse2.png",
        clothes=[_DATA / "clothes/male_casualsuit06/male_casualsuit06.mhclo"],
        rig=_DATA / "rig.game_engine.json",
        weights=_DATA / "weights.game_engine.json.gz",
        targets=[f"{_DATA}/targets/caucasian-{'female' if who == 'woman' else 'male'}-young.target.gz=1"],
    )
    return make_avatar(read_source(_DATA / "base.obj", extras), name=name, height=_HEIGHT[who]).avatar
