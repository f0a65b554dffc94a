"""Things as they are drawn: solid, soft, outlined."""
