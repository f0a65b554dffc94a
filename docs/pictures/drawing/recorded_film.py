"""Films of recorded conferences: a log is drawn picture by picture, and gets its sound."""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

Record = Callable[[Path], tuple[Path, float]]
"""Records a conference into a folder: its log, and when the film begins in it [s]."""


def film(description: str, script: Path, record: Record, *, site: str, seconds: float, fps: int, crf: int, still_s: float) -> None:
    """What a script of a film does: record, or take the log of `--keep`, draw what `site` sees, and write the film and the picture
    at `still_s` into it beside the script, under its name. crf: of the film's encoder, less is better."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", type=Path, help="Folder for the log and the film as drawn; one that has a log is filmed again.")
    parser.add_argument("--light", default="fast")
    parser.add_argument("--out", type=Path, default=script.with_name(f"{script.stem.replace('_', '-')}.mp4"))
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        log, begins = _recorded(folder, record)
        span = ["--from", f"{begins:.3f}", "--to", f"{begins + seconds:.3f}", "--fps", str(fps), "--light", arguments.light]
        vistel = Path(sys.executable).with_name("vistel")
        replay = [vistel, "replay", log, "--render", "--site", site, *span, "--out", folder / "film", "--force"]
        subprocess.run(replay, check=True)
        drawn = folder / "film" / f"{site}.mp4"
        coded = ["-c:v", "libx264", "-crf", str(crf), "-preset", "medium", "-pix_fmt", "yuv420p"]
        sound = ["-c:a", "aac", "-b:a", "64k", "-movflags", "+faststart"]
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", drawn, *coded, *sound, arguments.out], check=True)
        still = arguments.out.with_suffix(".png")
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-ss", str(still_s), "-i", drawn, "-frames:v", "1", still], check=True)


def _recorded(folder: Path, record: Record) -> tuple[Path, float]:
    """The log of a folder and when the film begins in it [s], recorded now where there is none."""
    kept = folder / "begins"
    if not kept.exists():
        log, begins = record(folder)
        kept.write_text(f"{begins}\n{log.relative_to(folder)}")
    begins, log = kept.read_text().splitlines()
    return folder / log, float(begins)
