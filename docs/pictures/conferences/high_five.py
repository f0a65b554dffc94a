"""Films high-five.mp4: two people at two sites clap each other's hands, and both sites' windows side by side, 240 pictures of each
second, shown eight times as slow.

    python -m docs.pictures.conferences.high_five

A conference of simulated trackers and gloves is computed in simulated time. Then each site gets what it would have got: messages of
its own at once, those of the other `LINK_NS` later and up to `JITTER_NS` more. What is drawn is what a site's window shows at that
moment: its own person without delay, the other one as late as the link makes it. Needs ffmpeg and an OpenGL context (software is
fine, and takes some minutes).
"""

import random
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vistel.conference.model import Conference, PlayoutConfig
from vistel.render.config import live_delay
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.stage.stage import Instant, Stage
from vistel.render.view.view import View
from vistel.wire.log import LogReader, LogRecord
from vistel.wire.world.recorded import TOPICS, RecordedWorld
from vistel_cli.testing.simulated_conference import SimulatedConference

OUT = Path(__file__).with_name("high-five.mp4")
SITES = {"tokyo": "aiko", "columbus": "ben"}
WIDTH, HEIGHT = 640, 480
RATE, SHOWN_RATE = 240, 30
BEGIN_S, END_S = 2.75, 4.45
LINK_NS, JITTER_NS = 20_000_000, 10_000_000
PREROLL_S = 1.5
STILL_S = 2.6
"""When the picture for the page is taken [s of the film]."""


def main() -> None:
    person = {"motion": "high-five", "height": 1.7}
    sites = [
        {"name": site, "participants": [person | {"name": name, "display_name": name.title(), "avatar": f"builtin:person={name}"}]}
        for site, name in SITES.items()
    ]
    conference = Conference.model_validate({"name": "high-five", "room": {"seats": 3}, "sites": sites})
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "high-five.mcap"
        with SimulatedConference(conference, log) as meeting:
            meeting.live(END_S + 0.5)
        films = [_filmed(LogReader(log), site, name, Path(folder) / f"{site}.mkv") for site, name in SITES.items()]
        coded = ["-c:v", "libx264", "-crf", "24", "-preset", "slow", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
        inputs = [word for film in films for word in ("-i", str(film))]
        subprocess.run(["ffmpeg", "-v", "error", "-y", *inputs, "-filter_complex", "hstack", *coded, str(OUT)], check=True)
    still = ["-ss", f"{STILL_S:.2f}", "-i", str(OUT), "-frames:v", "1", str(OUT.with_suffix(".png"))]
    subprocess.run(["ffmpeg", "-v", "error", "-y", *still], check=True)


def _filmed(reader: LogReader, site: str, own: str, film: Path) -> Path:
    """What a site's window shows, `RATE` times a second, to the last bit. One window after the other: a renderer has the OpenGL
    context of its process to itself."""
    size = ["-s", f"{WIDTH}x{HEIGHT}", "-r", str(SHOWN_RATE)]
    command = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", *size, "-i", "-", "-c:v", "ffv1", str(film)]
    renderer = SceneRenderer(View(WIDTH, HEIGHT, "seat", own), 3)
    try:
        with subprocess.Popen(command, stdin=subprocess.PIPE) as encoder:
            assert encoder.stdin is not None
            for instant in _instants(reader, site, own):
                encoder.stdin.write(np.ascontiguousarray(renderer.render_complete(instant)[::-1, :, :3]).tobytes())
            encoder.stdin.close()
    finally:
        renderer.close()
    return film


def _instants(reader: LogReader, site: str, own: str) -> Iterator[Instant]:
    stage, world = Stage(live_delay(PlayoutConfig()), frozenset({own})), RecordedWorld()
    waiting = _arriving(reader, site, own)
    for n in range(round((END_S - BEGIN_S + PREROLL_S) * RATE)):
        now_ns = reader.begin_ns + round((BEGIN_S - PREROLL_S + n / RATE) * 1e9)
        while waiting and waiting[0][0] <= now_ns:
            at_ns, record = waiting.pop(0)
            if record.topic.name == "participant":
                stage.receive_participant(record.message)
            elif record.topic.name == "motion":
                stage.receive_motion(record.names["participant"], record.message, at_ns)
            else:
                for room in world.take(record):
                    stage.receive_world(room, at_ns)
        instant = stage.instant(now_ns)
        if n >= PREROLL_S * RATE:
            yield instant


def _arriving(reader: LogReader, site: str, own: str) -> list[tuple[int, LogRecord]]:
    """What a site gets and when: what is another's, the world's too at all but the first site, comes over the link."""
    chance, out, newest = random.Random(site), list[tuple[int, LogRecord]](), dict[str, int]()
    for record in reader.records(topics=("participant", "motion", *TOPICS)):
        here = record.names.get("participant") == own or (record.topic.name in TOPICS and site == next(iter(SITES)))
        at_ns = record.log_ns + (0 if here else LINK_NS + round(chance.random() * JITTER_NS))
        newest[record.topic.name] = at_ns = max(at_ns, newest.get(record.topic.name, 0))
        out.append((at_ns, record))
    return sorted(out, key=lambda each: each[0])


if __name__ == "__main__":
    main()
