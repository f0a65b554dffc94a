"""Things of the room: their shapes, places on them, and ways they are led."""
