"""The one authority on the shared room: motion and commands in, the state of everything out, sixty times a second."""

from vistel_services.world.service import Config, configure, preload, run

__all__ = ["Config", "configure", "preload", "run"]
