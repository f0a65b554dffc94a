"""Draws people-in-postures.png: people, each in the standard postures.

    python -m docs.pictures.people.people_in_postures [--out FILE] [AVATAR ...]

AVATAR: what follows "builtin:", or an avatar file; without, built-in people. Needs an OpenGL context (EGL without a display;
software is fine).
"""

import argparse
from pathlib import Path

from vistel.figure.formats.load import load_any
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.standard import standard_postures
from vistel.render.figures.portrait import Portraits

PEOPLE = ("person=carla", "person=jonas", "person=ben", "person=david", "person=aiko", "person=erik")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("people", nargs="*", default=PEOPLE)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "people-in-postures.png")
    arguments = parser.parse_args()
    avatars = [
        load_any(Path(p)) if Path(p).is_file() else builtin_avatar(f"builtin:{p}", name=p, height=1.75) for p in arguments.people
    ]
    portraits = Portraits()
    sheet = portraits.sheet(avatars, standard_postures(), (130, 180))
    sheet.save(arguments.out, optimize=True)
    portraits.close()


if __name__ == "__main__":
    main()
