"""Where a running conference keeps its files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RunPaths:
    """`run`: ports and sockets of this run, gone afterwards; `out`: what the user keeps (videos, log, report)."""

    run: Path
    out: Path

    def device(self, name: str) -> Path:
        """The port of a simulated device, a link to a pseudo-terminal."""
        return self.run / "dev" / name

    def video(self, site: str) -> Path:
        """The video of what a site shows."""
        return self.out / f"{site}.mp4"

    def videos(self, site: str) -> list[Path]:
        """The videos a site has written: one, and a numbered one for each time its renderer was started again."""
        return sorted(p for p in self.out.glob(f"{site}*.mp4") if p.stem.split(".")[0] == site)

    def metrics(self, node: str) -> Path:
        """Where Prometheus reads the address of a process "site/label"; it exists while the process runs."""
        return self.out / "metrics" / f"{node.replace('/', '-')}.json"

    @property
    def log(self) -> Path:
        """The log of the conference."""
        return self.out / "conference.mcap"

    @property
    def logs(self) -> list[Path]:
        """The files of the log: one, and a numbered one each time that a new one was begun."""
        return sorted((p for p in self.out.glob("conference*.mcap") if p.stem.split(".")[0] == "conference"), key=_number)

    @property
    def report(self) -> Path:
        """The figures of the run, as JSON."""
        return self.out / "report.json"


def free_path(path: Path, used: Sequence[Path] = ()) -> Path:
    """`path`, or, if it exists or was `used`, the next free "name.2.mcap"."""
    number, other = 1, path
    while other.exists() or other in used:
        number += 1
        other = path.with_name(f"{path.stem}.{number}{path.suffix}")
    return other


def _number(file: Path) -> int:
    """2 of "name.2.mcap"; 0 of the first."""
    number = file.stem.partition(".")[2]
    return int(number) if number.isdecimal() else 0
