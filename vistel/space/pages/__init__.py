"""Pictures and pages that people show in the room: read from their files, made polymeshes, put up on panels."""
