"""A conference file is checked, and each fault is one line that names file, key and what was expected."""

from __future__ import annotations

from pathlib import Path

import pytest

from vistel.conference.files import DEMO_FILE, ConferenceError, load
from vistel.conference.model import Conference

GOOD = """
name = "small"
[room]
seats = 3
[[sites]]
name = "tokyo"
[[sites.participants]]
name = "aiko"
[[sites]]
name = "columbus"
[[sites.participants]]
name = "ben"
seat = 0
"""


def _load(tmp_path: Path, text: str) -> Conference:
    file = tmp_path / "c.toml"
    file.write_text(text, "utf-8")
    return load(file)


def test_the_demo_conference_is_valid_and_has_three_sites() -> None:
    conference = load(DEMO_FILE)
    assert [s.name for s in conference.sites] == ["tokyo", "columbus", "zurich"]
    assert all(len(s.processes) == 2 for s in conference.sites)


def test_automatic_seats_leave_out_the_seats_that_are_named(tmp_path: Path) -> None:
    conference = _load(tmp_path, GOOD)
    assert conference.seat_of("ben") == 0
    assert conference.seat_of("aiko") == 1


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (('name = "small"', 'nmae = "small"'), [":2: nmae: unknown key; did you mean name?"]),
        (("seats = 3", 'seats = "three"'), ["room.seats", "expected a whole number"]),
        (('name = "columbus"', 'name = "tokyo"'), ["sites[1].name", "tokyo stands more than once"]),
        (('name = "ben"', 'name = "aiko"'), ["participants[0].name", "aiko stands more than once"]),
        (("seats = 3", "seats = 1000000000"), ["room.seats", "1000"]),
        (("seats = 3", "seats = 1"), ["room.seats", "too few for 2 participants"]),
        (("[room]", '[bus]\nendpoints = ["tcp/here"]\n[room]'), ["bus.endpoints[0]: is 'tcp/here', expected tcp/HOST:PORT"]),
        (('name = "aiko"', 'name = "Aiko!"'), ["sites[0].participants[0].name", "lower-case letters"]),
        (("[room]", "[room"), ["not valid TOML"]),
        (("[room]", '[playout]\ndelay = "soon"\n[room]'), ["playout.delay"]),
        (("[room]", "[playout]\nleast = 0.6\n[room]"), ["playout", "least is 0.6, more than most, which is 0.5"]),
        (("[room]", "[playout]\ndelay = 0.1\nmost = 0.2\n[room]"), ["playout", 'most is for delay = "auto"']),
        (("[room]", "[playout]\nin_time = 1.5\n[room]"), ["playout.in_time"]),
        (('[[sites.participants]]\nname = "aiko"', ""), ["sites[0].participants"]),
    ],
)
def test_a_faulty_file_names_file_key_and_expectation(tmp_path: Path, change: tuple[str, str], expected: list[str]) -> None:
    assert change[0] in GOOD
    with pytest.raises(ConferenceError) as error:
        _load(tmp_path, GOOD.replace(*change, 1))
    text = str(error.value)
    assert "c.toml" in text
    for part in expected:
        assert part in text


@pytest.mark.parametrize("said", ["", "[playout]\ndelay = 0.1", '[playout]\ndelay = "auto"\nleast = 0.05\nin_time = 0.95'])
def test_a_delay_of_playout_comes_back_from_a_log_as_it_was(tmp_path: Path, said: str) -> None:
    conference = _load(tmp_path, f"{GOOD}{said}")
    again = Conference.model_validate(conference.model_dump(mode="json", exclude_none=True))
    assert again.playout == conference.playout
    assert again.playout.recorded_s == 0.1


WITH_PROP = GOOD.replace('name = "ben"', 'name = "ben"\n[[sites.props]]\nthing = "baton"\ntracker = { station = 2 }')


def test_a_site_may_have_a_prop_whose_tracker_has_a_name_of_its_own(tmp_path: Path) -> None:
    (prop,) = _load(tmp_path, WITH_PROP.replace("seat = 0", "")).sites[1].props
    assert (prop.thing, prop.device, prop.tracker.station) == ("baton", "prop-baton-tracker", 2)
    assert prop.tracker.port == "sim"


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (('thing = "baton"', 'thing = "unicorn"'), ["sites[1].props[0].thing", "expected one of baton, ball", "unicorn"]),
        (('thing = "baton"', 'thing = "table"'), ["sites[1].props[0].thing", "no such loose thing"]),
        (('thing = "baton"', ""), ["sites[1].props[0].thing", "is missing"]),
        (("station = 2", "station = 5"), ["sites[1].props[0].tracker.station"]),
        (("station = 2", "stations = { chest = 1 }"), ["sites[1].props[0].tracker.stations", "unknown key"]),
        (("station = 2", "receiver_rotation = [0, 0, 0, 0]"), ["tracker.receiver_rotation", "unit quaternion"]),
        (('name = "aiko"', 'name = "prop-baton"'), ["participants", "prop-baton's tracker", "name the participant"]),
        (("[[sites]]\n", '[[sites]]\nprops = [{ thing = "baton" }]\n'), ["props", "baton stands more than once"]),
    ],
)
def test_a_faulty_prop_is_named_with_its_key(tmp_path: Path, change: tuple[str, str], expected: list[str]) -> None:
    text = WITH_PROP.replace("seat = 0", "")
    assert change[0] in text
    with pytest.raises(ConferenceError) as error:
        _load(tmp_path, text.replace(*change, 1))
    for part in ("c.toml", *expected):
        assert part in str(error.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConferenceError, match=r"none\.toml: cannot be read"):
        load(tmp_path / "none.toml")


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "c.toml"
    file.write_bytes(b"\xff\xfe\x00name")
    with pytest.raises(ConferenceError, match=r"c\.toml:1: is no UTF-8 text; save"):
        load(file)
