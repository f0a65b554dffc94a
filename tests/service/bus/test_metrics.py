"""Metrics are served, found by Prometheus, and stand in the reference page."""

import json
import re
import time
import urllib.request

from scripts.metrics_reference import PAGE, page
from scripts.metrics_reference import metrics as listed
from vistel.conference.paths import RunPaths
from vistel_services.process import metrics

HOW_TO = PAGE.parents[1] / "how-to/collect-metrics.md"


def test_the_reference_page_is_made_from_the_source():
    assert PAGE.read_text("utf-8") == page(), "run `python -m scripts.metrics_reference`"


def test_metrics_are_named_after_their_service_and_end_in_a_unit_or_a_count():
    units = "seconds|bytes|db|hertz|ratio|total|count|known|sensors|samples|readers"
    assert listed()
    assert not [m.name for m in listed() if not re.fullmatch(rf"vistel_[a-z]+_[a-z_]*?({units})", m.name)]
    assert not [m.name for m in listed() if (m.kind == "Counter") != m.name.endswith("_total")]


def test_the_how_to_names_metrics_that_there_are():
    assert set(re.findall(r"`(vistel_\w+)`", HOW_TO.read_text("utf-8"))) <= {m.name for m in listed()}


def test_a_process_is_found_and_read_while_it_runs_and_forgotten_afterwards(tmp_path):
    file = RunPaths(tmp_path, tmp_path / "out").metrics("tokyo/renderer")
    port = metrics.serve("tokyo/renderer", ("renderer",), time.time())
    with metrics.announced(file, "tokyo/renderer", port):
        (told,) = json.loads(file.read_text("utf-8"))
        assert told["labels"] == {"site": "tokyo", "process": "renderer"}
        with urllib.request.urlopen(f"http://{told['targets'][0]}/metrics", timeout=60.0) as answer:
            assert b'vistel_process_start_time_seconds{node="tokyo/renderer",services="renderer"}' in answer.read()
    assert not list(file.parent.iterdir())


def test_a_folder_that_cannot_be_written_is_one_line_and_stops_nothing(tmp_path, caplog):
    (tmp_path / "out").write_text("a file where a folder should be")
    with metrics.announced(tmp_path / "out" / "metrics" / "a.json", "tokyo/renderer", 9):
        pass
    assert len(caplog.records) == 1
    assert "not announced" in caplog.text


def test_a_process_without_a_port_announces_nothing(tmp_path):
    with metrics.announced(tmp_path / "a.json", "hub/world", 0):
        assert not list(tmp_path.iterdir())
