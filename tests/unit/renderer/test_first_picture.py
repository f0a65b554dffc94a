"""The first picture is told once, with what took its time."""

from __future__ import annotations

import logging
import re
import time

import pytest
from prometheus_client import REGISTRY

from vistel_services.renderer.first_picture import FirstPicture, process_age_s


def test_the_first_picture_is_reported_once_and_its_parts_are_the_whole(caplog: pytest.LogCaptureFixture) -> None:
    first = FirstPicture("osaka")
    with caplog.at_level(logging.INFO, "vistel.renderer"):
        first.done("opening")
        first.done("setting_up")
        first.shown(3, 1)
        first.shown(3, 0)
    (line,) = [r.getMessage() for r in caplog.records if "first_picture" in r.getMessage()]
    assert "people=3 stand_ins=1" in line
    said = {name: float(value) for name, value in re.findall(r"(\w+?)(?:_s)?=([\d.]+)", line)}
    parts = [said[part] for part in ("loading", "opening", "setting_up", "drawing")]
    assert said["seconds"] == pytest.approx(sum(parts), abs=0.03)
    assert REGISTRY.get_sample_value("vistel_renderer_first_picture_seconds", {"site": "osaka"}) == pytest.approx(
        said["seconds"], abs=0.01
    )


def test_a_process_grows_older_as_the_system_says() -> None:
    at_least_before, before, at_most_before = time.perf_counter(), process_age_s(), time.perf_counter()
    at_least_after, after, at_most_after = time.perf_counter(), process_age_s(), time.perf_counter()
    assert before > 0.0
    assert at_least_after - at_most_before - 1e-3 <= after - before <= at_most_after - at_least_before + 1e-3
