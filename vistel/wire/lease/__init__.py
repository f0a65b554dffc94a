"""Who may lead a room: whoever holds its lease, in a system that is made to give a thing to one at a time."""
