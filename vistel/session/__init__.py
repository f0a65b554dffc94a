"""A running conference from a program: watch the room and the people, give commands, take part."""
