"""Draws panel.png: slides of a PDF on a panel of a meeting, as the room is seen as a whole. It runs the demo for half a minute
without windows, shows the slides of `vistel examples` in it, and draws a moment of its log.

python -m docs.pictures.panel.panel
"""

import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import tomli_w

from vistel.conference.files import DEMO_FILE, load
from vistel.wire.log import LogReader
from vistel_cli.examples.slides import SLIDES, pdf

COMMAND = [sys.executable, "-m", "vistel_cli.main"]
AFTER_S = 6.0
"""From the panel's coming to the moment that is drawn."""


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        data = load(DEMO_FILE).model_dump(mode="json", exclude_none=True)
        for site in data["sites"]:
            site["processes"] = [["tracker", "glove", "posture"]]  # drawn later
        (folder / "demo.toml").write_text(tomli_w.dumps(data))
        (folder / "slides.pdf").write_bytes(pdf(SLIDES))
        run = [*COMMAND, "up", "demo.toml", "--no-console", "--out", "out"]
        with subprocess.Popen(run, stdout=subprocess.PIPE, text=True, cwd=folder) as up:
            next(line for line in up.stdout or () if "everybody sees everybody" in line)
            subprocess.run([*COMMAND, "show", "slides.pdf", "--as", "aiko"], check=True, cwd=folder)
            try:
                up.wait(2.0 * AFTER_S)
            except subprocess.TimeoutExpired:
                up.send_signal(signal.SIGINT)
        log = folder / "out" / "conference.mcap"
        reader = LogReader(log)
        at_s = AFTER_S + 1e-9 * (next(r.log_ns for r in reader.records(topics=("picture_part",))) - reader.begin_ns)
        look = ["--render", "--png", "--site", "tokyo", "--view", "room", "--size", "1280x720", "--supersample", "2", "--no-names"]
        span = ["--from", f"{at_s:.2f}", "--to", f"{at_s + 0.5:.2f}", "--fps", "2", "--out", str(folder / "film")]
        subprocess.run([*COMMAND, "replay", str(log), *look, *span], check=True)
        shutil.copyfile(min((folder / "film").rglob("*.png")), Path(__file__).parent / "panel.png")


if __name__ == "__main__":
    main()
