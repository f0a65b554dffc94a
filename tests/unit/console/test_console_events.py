"""The console's page lists what happens in the room while it is open."""

from typing import Any

import pytest
from page_module import in_node

PROGRAM = """
globalThis.document = { documentElement: {} };
globalThis.navigator ??= { language: "en" };
globalThis.localStorage = { getItem: () => null };
const { Events } = await import("./module.mjs");
let seconds = 0;
const events = new Events(() => new Date(seconds * 1e3));
const kinds = { table: "receiveTable", held: "receiveHeld", signals: "receiveSignals", numbers: "receiveNumbers" };
for (const words of given) {
  if (words === "begin") events.begin();
  else if (words.kind === "wait") seconds += words.seconds;
  else if (words.kind === "captions") events.receiveCaptions(words.captions);
  else if (words.kind === "answers") events.receiveAnswers(words);
  else events[kinds[words.kind]](words);
}
console.log(JSON.stringify(events.lines.map(({ text, bad }) => [text, bad])));
"""


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """What the page lists, the newest first, after it was told something."""
    return in_node(tmp_path_factory.mktemp("events"), "console/events.tsx", PROGRAM)


def table(*people: str) -> dict[str, Any]:
    rows = [{"name": name.lower(), "shown": name} for name in people]
    return {"kind": "table", "people": rows, "things": [{"id": "baton", "name": "red baton"}]}


def held(*grasps: tuple[str, str, str]) -> dict[str, Any]:
    return {"kind": "held", "grasps": grasps, "touching": []}


def device(state: str, *troubles: str) -> dict[str, Any]:
    return {"kind": "numbers", "devices": [{"name": "glove", "state": state, "detail": "no answer"}], "troubles": troubles}


def test_what_is_there_at_first_has_not_just_happened(said: Any) -> None:
    assert said([table("Ann", "Ben"), held(), {"kind": "signals", "raised": [["ann", False]]}, device("lost")]) == []


def test_who_comes_goes_takes_and_lets_go_is_listed_the_newest_first(said: Any) -> None:
    ann = ("ann", "left", "baton")
    told = [table("Ann"), table("Ann", "Ben"), held(), held(ann), held(), table("Ben")]
    assert [text for text, _ in said(told)] == ["Ann is gone", "Ann lets go of red baton", "Ann takes red baton", "Ben is here"]


def test_what_breaks_and_comes_back_is_listed_and_marked(said: Any) -> None:
    told = [device("streaming"), device("lost"), device("lost", "no world"), device("streaming", "no world"), device("absent")]
    assert said(told) == [["glove sends again", False], ["no world", True], ["glove sends no more: no answer", True]]


@pytest.mark.parametrize(("seconds", "lines"), [(20, 1), (40, 2)])
def test_a_trouble_that_comes_back_soon_was_not_over(said: Any, seconds: int, lines: int) -> None:
    busy = device("streaming", "its machine is busy")
    told = [busy, device("streaming"), {"kind": "wait", "seconds": seconds}, busy]
    assert said(told) == [["its machine is busy", True]] * lines


def test_commands_and_their_answers_are_listed_once_and_hands_as_they_go_up(said: Any) -> None:
    asked, answered = ({"who": "Ann", "text": "take the baton", "mark": "", "reply": reply} for reply in ("", "done"))
    captions = [{"kind": "captions", "captions": [c]} for c in (asked, asked, answered)]
    hands = [{"kind": "signals", "raised": raised} for raised in ([], [["ann", True]], [["ann", True]])]
    assert [text for text, _ in said([table("Ann"), *captions, *hands])] == [
        "Ann raises a hand",
        "Ann: “take the baton” → done",
        "Ann: “take the baton”",
    ]


def test_commands_that_were_done_and_refused_are_listed_once(said: Any) -> None:
    rows = [{"id": str(n), "who": "ann", "text": "move thing", "done": not n, "reason": "no ball" * n} for n in range(2)]
    told = [table("Ann"), *[{"kind": "answers", "answers": rows[:count]} for count in (0, 1, 1, 2)]]
    assert said(told) == [["Ann: move thing, refused: no ball", True], ["Ann: move thing, done", False]]


def test_another_room_begins_with_an_empty_list(said: Any) -> None:
    assert said([table("Ann"), table(), "begin", table("Ben")]) == []


def test_a_hundred_lines_are_kept(said: Any) -> None:
    assert len(said([table("Ann"), *[held(*([("ann", "left", "baton")] * (n % 2))) for n in range(300)]])) == 100
