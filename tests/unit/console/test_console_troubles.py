"""What the console says is wrong: a line each, with names and what to do."""

from vistel.session.going.troubles import troubles

WELL = {
    "services": [{"node": "hub/world", "silent_s": 0.4}],
    "sites": [{"name": "tokyo", "draws": True, "pictures_per_s": 24.0, "silent_s": 0.2}, {"name": "gallery", "draws": False}],
    "people": [{"shown": "Aiko", "age_ms": 30.0}],
}


def test_where_all_is_well_nothing_is_said() -> None:
    devices = [{"name": "glove", "state": "streaming", "detail": ""}, {"name": "page", "state": "absent", "detail": "nobody"}]
    assert troubles(WELL, devices) == []


def test_what_is_silent_slow_or_still_is_named() -> None:
    ill = {
        "services": [{"node": "hub/world", "silent_s": 7.0}],
        "sites": [
            {"name": "tokyo", "draws": True, "pictures_per_s": 3.0, "silent_s": 0.2},
            {"name": "zurich", "draws": True, "pictures_per_s": 30.0, "silent_s": 9.0},
        ],
        "people": [{"shown": "Aiko", "age_ms": 2400.0}],
    }
    devices = [{"name": n, "state": "searching", "detail": "no such port"} for n in ("a", "b")]
    assert troubles(ill, devices) == [
        "hub/world is silent; its log says why",
        "tokyo draws less than 10 pictures a second; its machine is busy",
        "zurich draws no pictures; see the log of its renderer",
        "a, b: no such port; vistel doctor looks at devices",
        "Aiko stands still: no motion comes; see the site's devices",
    ]


def test_a_trouble_is_the_same_words_while_its_figures_change() -> None:
    def said(amount: float) -> list[str]:
        site = {"name": "tokyo", "draws": True, "pictures_per_s": 9.0 / amount, "silent_s": 0.2}
        people = [{"shown": "Aiko", "age_ms": 2e3 * amount}]
        return troubles({"services": [{"node": "hub/world", "silent_s": 5.0 * amount}], "sites": [site], "people": people}, [])

    assert len(said(1.0)) == 3 and said(1.0) == said(2.0)
