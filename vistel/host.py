"""Under which name the host of a conference asks the world for something: a participant of the hub, without a figure and without a
seat, whose commands the console gives. No participant of a conference file has this name."""

HOST = "host"
