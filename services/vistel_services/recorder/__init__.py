"""Writes every recorded topic into one log."""

from vistel_services.recorder.service import Config, configure, run

__all__ = ["Config", "configure", "run"]
