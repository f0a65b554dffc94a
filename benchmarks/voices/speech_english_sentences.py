"""What a person would say to the room in English, against sentences drawn from the grammar, of which many are odd."""

DEVELOPMENT = (
    "move it to the left", "move this up a little", "move the red box to the right", "make it larger",
    "make this a little smaller", "turn it to the left", "delete it", "delete the blue ball", "copy this", "select the cone",
    "undo", "stop", "create a red ball", "create a small blue box here", "put it there", "put the chair over there",
    "bring me the green cylinder", "paint it blue", "make it yellow", "make the ring thicker", "push it", "pull the table",
    "lift the lump a little", "turn the chair a little to the right", "stretch this vertically", "bend it a little",
    "twist the bar", "make it straight", "attach this to that", "fix the ball to the bar", "flip it", "tip over the cone",
    "release it", "grab the baton", "make it twice as large", "make the box half as large", "yes", "no", "once more",
    "make it softer", "make the cylinder taller", "slide the tile away from me", "move that down",
    "rotate the plate horizontally", "remove the white ring", "let go of the stick", "hold this", "take it apart",
    "create a cone over there", "move the little orange box towards me",
)  # fmt: skip
"""To choose settings with."""
TEST = (
    "move this to the right", "move it up", "move the box a little to the left", "make it bigger", "make that smaller",
    "turn this to the right", "remove it", "delete the red cone", "copy the ball", "select this", "undo that", "redo",
    "stop that", "create a box", "make a green cylinder here", "put this here", "put the ball over there", "bring the chair",
    "paint the box red", "make this white", "make the bar a little longer", "push the box a little", "pull it", "raise this",
    "turn the table a little to the left", "stretch the ring", "bend this", "twist it a lot", "make the bar straight",
    "attach the cone to the box", "fix this to the table", "turn it over", "lay down the cylinder", "release the ball",
    "take the stick", "make this twice as large", "make the ball half as large", "yes please", "no thanks", "again",
    "make the lump hard", "make it lower", "slide it back", "move the big blue ball forward", "rotate it to the left",
    "delete everything", "let go of it", "grab that", "take the chair apart", "create a large yellow ring over there",
)  # fmt: skip
"""To score with; none of them was looked at when settings were chosen."""
