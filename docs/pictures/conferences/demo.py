"""Draws demo.png and table.png from the log that `make demo` left in out/latest: the moment when two people hold the baton, as the
third one sees it and from the room.

make demo && python -m docs.pictures.conferences.demo
"""

import shutil
import subprocess
import sys
import tempfile
from itertools import pairwise
from pathlib import Path

from vistel.wire.log import LogReader
from vistel.wire.world.recorded import TOPICS, RecordedWorld

ROOT = Path(__file__).resolve().parents[3]
THIRD = {"aiko": "tokyo", "ben": "columbus", "carla": "zurich"}
"""Whose picture it is: that of somebody who looks on."""

APART_NS = 200_000_000
"""Between two states of different hand-overs."""


def main() -> None:
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "out" / "latest"
    reader = LogReader(out / "conference.mcap")
    world = RecordedWorld()
    rooms = [(now, r.log_ns) for r in reader.records(topics=TOPICS) for now in world.take(r)]
    shared = [(now, log_ns) for now, log_ns in rooms if len({g.participant for g in now.grasps}) > 1]
    if not shared:
        sys.exit(f"{out}: nobody hands anything over in this log; run `make demo` for 20 s or longer")
    starts = [0, *(n for n in range(1, len(shared)) if shared[n][1] - shared[n - 1][1] > APART_NS), len(shared)]
    begin, end = max(pairwise(starts), key=lambda span: span[1] - span[0])
    moment, log_ns = shared[begin + 3 * (end - begin) // 4]  # what is drawn is a little older
    holders = {g.participant for g in moment.grasps}
    site = next(site for name, site in THIRD.items() if name not in holders)
    at_s = (log_ns - reader.begin_ns) * 1e-9
    for name, view in (("demo", "seat"), ("table", "room")):
        with tempfile.TemporaryDirectory() as folder:
            look = ["--render", "--png", "--site", site, "--view", view, "--size", "960x540", "--supersample", "2"]
            span = ["--from", f"{at_s - 1.0:.2f}", "--to", f"{at_s:.2f}", "--fps", "5", "--out", folder]
            subprocess.run([sys.executable, "-m", "vistel_cli.main", "replay", str(reader.path), *look, *span], check=True)
            path = ROOT / f"docs/pictures/conferences/{name}.png"
            shutil.copyfile(max(Path(folder).rglob("*.png")), path)
        print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
