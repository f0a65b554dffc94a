"""The table of topics and the page made from it."""

from __future__ import annotations

import pytest

from vistel.wire.reference import PAGE, page
from vistel.wire.topics import BY_NAME, TOPICS, Topic

NAMES = {
    "conference": "demo",
    "site": "tokyo",
    "participant": "ann",
    "device": "ann-tracker",
    "node": "capture",
    "thing": "baton",
    "hand": "left",
    "digest": "0123abcd",
    "picture": "0123abcd",
    "part": "0001",
    "equipment": "delay",
    "holder": "tokyo",
    "reader_site": "paris",
    "reader": "bob",
}


def key_of(topic: Topic) -> str:
    return topic.format(**{f: NAMES[f] for f in topic.fields})


def test_every_key_belongs_to_exactly_one_topic_and_gives_its_names_back() -> None:
    for topic in TOPICS:
        matches = {t.name: t.match(key_of(topic)) for t in TOPICS if t.match(key_of(topic)) is not None}
        assert matches == {topic.name: {f: NAMES[f] for f in topic.fields}}


def test_names_are_unique() -> None:
    assert len(BY_NAME) == len(TOPICS)


@pytest.mark.parametrize("name", ["", "Ann", "a/b", "*", "a b", "..", "$", "é"])
def test_a_name_that_may_not_stand_in_a_key_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="participant: expected lower-case"):
        BY_NAME["motion"].format(conference="demo", site="tokyo", participant=name)


def test_the_reference_page_is_up_to_date() -> None:
    assert PAGE.read_text("utf-8") == page(), "run `python -m vistel.wire.reference`"
