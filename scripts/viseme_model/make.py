"""Makes the net that reads visemes from the sound of a voice: `make viseme-model`. See docs/explanation/faces.md.

Everything is drawn from one seed; speech that is on disk already is not made again.
"""

import argparse
import sys
from pathlib import Path

from scripts.speech_model import english, voices
from scripts.speech_model.corpus import Net
from scripts.speech_model.make import trained
from scripts.viseme_model.corpus import tune
from vistel.audio.visemes import VISEMES
from vistel.speech.acoustic import model_file, save

NET = Net(phones=VISEMES, offsets=(-11, -8, -6, -4, -3, -2, -1, 0, 1, 2), hidden=(160, 96), throats=True)
"""It hears 20 ms more than the frame that it tells of: a mouth cannot wait for more."""
_ROUNDS, _SHARE = 12, 0.7


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path("out/viseme-model"), help="where speech is kept")
    parser.add_argument("--out", type=Path, default=model_file("visemes"), help="default: the file in the package")
    parser.add_argument("--rounds", type=int, default=_ROUNDS)
    parser.add_argument("--seed", type=int, default=9)
    given = parser.parse_args()
    if (reason := english.ENGLISH.lacking() or voices.missing()) is not None:
        print(reason, file=sys.stderr)
        return 1
    given.folder.mkdir(parents=True, exist_ok=True)
    made = trained(NET, tune(given.folder, given.seed), given.rounds, _SHARE, given.seed)
    save(made, given.out)
    print(f"written: {given.out}, {given.out.stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
