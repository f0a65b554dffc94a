"""Takes docs/pictures/demo.png from what `make demo` left in out/: the moment when two people hold the baton.

    make demo && .venv/bin/python docs/pictures/demo.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import av

from vistel.wire.log import LogReader
from vistel.wire.world import WorldDecoder

ROOT = Path(__file__).resolve().parents[2]
THIRD = {"aiko": "tokyo", "ben": "columbus", "carla": "zurich"}
"""Whose picture it is: that of somebody who looks on."""


def main() -> None:
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "out"
    reader = LogReader(out / "conference.mcap")
    decoder = WorldDecoder()
    rooms = [(now, r.log_ns) for r in reader.records(topics=("world_state",)) for now in decoder.read(r.message)]
    shared = [(now, log_ns) for now, log_ns in rooms if len({g.participant for g in now.grasps}) > 1]
    if not shared:
        sys.exit(f"{out}: nobody hands anything over in this log; run `make demo` for 20 s or longer")
    moment, log_ns = shared[len(shared) // 2]
    holders = {g.participant for g in moment.grasps}
    site = next(site for name, site in THIRD.items() if name not in holders)
    delays = reader.records(topics=("image_delay",))
    # A renderer reports twice a second and films from the first picture with somebody in it.
    begin_ns = next(r.message.header.t_ns for r in delays if r.names["site"] == site and r.message.streams)
    due_s = (log_ns - begin_ns) * 1e-9 + 0.5
    with av.open(str(out / f"{site}.mp4")) as video:
        frame = min(video.decode(video=0), key=lambda f: abs(float(f.time or 0.0) - due_s))
    path = ROOT / "docs/pictures/demo.png"
    frame.to_image().save(path)
    print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
