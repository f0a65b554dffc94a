"""Where a running conference keeps its files."""

from __future__ import annotations

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
        return self.out / f"{site}.mp4"

    @property
    def log(self) -> Path:
        return self.out / "conference.mcap"

    @property
    def report(self) -> Path:
        return self.out / "report.json"
