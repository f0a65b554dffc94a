"""Joints of things with the room and with each other: hinges, sliders, what drives them, and buttons."""
