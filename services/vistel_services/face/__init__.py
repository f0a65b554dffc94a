"""The faces of a site: FaceFrame messages from phones with Live Link Face, face cameras and eye cameras."""

from vistel_services.face.service import Config, configure, preload, run

__all__ = ["Config", "configure", "preload", "run"]
