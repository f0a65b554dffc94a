"""`vistel.join`: what cannot be joined is named in one line, and nothing is left running."""

from __future__ import annotations

import gc
import threading
import warnings
from pathlib import Path

import pytest

import vistel
from vistel.conference.files import DEMO_FILE, ConferenceError
from vistel.session.blocking import place_of
from vistel.wire.zenoh.bus import BusError

HUB = "tcp/127.0.0.1:1"
"""A port at which nobody listens."""


def test_the_first_participant_of_the_site_asks_unless_one_is_named() -> None:
    assert place_of(DEMO_FILE, None, None, HUB)[1:3] == ("tokyo", "aiko")
    assert place_of(DEMO_FILE, "columbus", None, HUB)[1:3] == ("columbus", "ben")
    assert place_of(DEMO_FILE, None, "carla", HUB)[1:3] == ("zurich", "carla")


@pytest.mark.parametrize(
    ("site", "participant", "hub", "told"),
    [
        ("osaka", None, HUB, "no site is called 'osaka'; there are tokyo, columbus, zurich"),
        (None, "bne", HUB, "no participant is called 'bne'; there are aiko, ben, carla"),
        ("tokyo", "ben", HUB, "no participant at tokyo is called 'ben'; there are aiko"),
        (None, None, None, "demo does not run on this machine; name its router with hub="),
    ],
)
def test_what_cannot_be_joined_is_named_in_one_line(
    site: str | None, participant: str | None, hub: str | None, told: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # nothing runs
    with pytest.raises(ConferenceError) as error:
        vistel.join(DEMO_FILE, site, participant, hub)
    assert told in str(error.value) and "\n" not in str(error.value)


def test_where_no_router_answers_it_says_so_and_leaves_no_thread() -> None:
    with pytest.raises(BusError), vistel.join(DEMO_FILE, hub=HUB):
        pass
    assert not [t for t in threading.enumerate() if t.name == "vistel session"]


def test_a_session_outside_a_with_says_how_it_is_used() -> None:
    with pytest.raises(RuntimeError, match=r"with vistel\.join"):
        vistel.join(DEMO_FILE, hub=HUB).ask("undo")


def test_a_session_that_is_never_entered_leaves_nothing_open() -> None:
    with warnings.catch_warnings(record=True) as left:
        warnings.simplefilter("always", ResourceWarning)
        vistel.join(DEMO_FILE, hub=HUB)
        gc.collect()
    assert [str(w.message) for w in left] == []
