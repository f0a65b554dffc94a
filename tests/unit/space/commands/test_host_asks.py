"""The host asks, who has no figure in the room."""

from __future__ import annotations

from talking import Talk, done, refused

from vistel.host import HOST
from vistel.space.commands.phrase import read

DONE = (
    "paint the baton blue",
    "undo",
    "scale the ball 1.2",
    "bend the baton 30",
    "hide the tile",
    "show",
    "select the box",
    "paint selected green",
    "turn the can 90",
    "move the ball up 10 cm",
    "delete the cone",
    "reset",
)


def test_the_host_does_what_needs_no_place_and_no_hands() -> None:
    talk = Talk()
    for line in DONE:
        done(talk.say(read(line), HOST))
        talk.wait(20)


def test_what_needs_the_hosts_place_or_figure_is_refused_and_others_without_one_ask_nothing() -> None:
    talk = Talk()
    for line in ("move the ball left", "create red box here", "put the tile here", "copy the box", "note buy milk"):
        assert "the host stands nowhere in the room" in refused(talk.say(read(line), HOST)), line
    for line in ("hand up", "react clap"):
        assert refused(talk.say(read(line), HOST)) == "host is not in the room", line
    assert "none of your free hands" in refused(talk.say(read("take the ball"), HOST))
    assert refused(talk.say(read("reset"), "nobody")) == "nobody is not in the room"
