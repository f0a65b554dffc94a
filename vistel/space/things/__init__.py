"""Things of the room: their shapes, their motion by commands and trackers, and their triangles."""
