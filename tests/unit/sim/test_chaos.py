"""Plans of random faults, and what of a run under them is found to be wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from vistel.messages.world.verify import Record
from vistel.v1.service_pb2 import ImageDelay
from vistel_sim.chaos.__main__ import main
from vistel_sim.chaos.invariants import Span, files_back, memory_back, no_stale_motion
from vistel_sim.chaos.kinds import KINDS, Target
from vistel_sim.chaos.plan import LASTING_S, MOVE, planned
from vistel_sim.chaos.report import died

SITES, PROCESSES = ["tokyo", "lima"], ["hub/world", "tokyo/renderer"]


def test_the_same_seed_gives_the_same_faults_and_another_one_others() -> None:
    one, again, other = (planned(seed, 120.0, SITES, PROCESSES, ["hub", "lima"]) for seed in (1, 1, 2))
    assert one == again != other


def test_every_kind_of_fault_comes_strikes_what_it_can_and_is_over_in_time() -> None:
    plan = planned(3, 3600.0, SITES, PROCESSES, ["hub", "lima"])
    assert {p.name for p in plan} == {*KINDS, MOVE}
    for p in plan:
        assert p.at_s + (p.seconds or 0.0) <= 3600.0
        if p.name != MOVE:
            kind = KINDS[p.name]
            assert p.target in {Target.SITE: SITES, Target.PROCESS: PROCESSES, Target.CONFERENCE: [""]}[kind.target]
            assert (p.seconds is None) == (kind.seconds == 0.0) and (p.amount is None) == (kind.unit == "")
            assert p.seconds is None or LASTING_S[0] <= p.seconds <= LASTING_S[1]


def picture(t_s: float, delay_s: float, frames: int) -> Record:
    """A report of what tokyo shows of aiko."""
    message = ImageDelay(site="tokyo", frames=frames)
    message.header.t_ns = round(t_s * 1e9)
    message.streams.add(participant="aiko", shown_ns=round((t_s - delay_s) * 1e9))
    return "image_delay", {"site": "tokyo"}, message, round(t_s * 1e9)


def test_a_figure_that_goes_back_in_time_is_found() -> None:
    stands = [picture(1.0, 0.1, 10), picture(1.5, 0.6, 20), picture(2.0, 1.1, 30), picture(2.5, 0.1, 40)]
    assert no_stale_motion(stands) == []
    assert no_stale_motion([*stands, picture(2.6, 0.215, 50)]) == []  # by what was predicted
    assert no_stale_motion([*stands, picture(3.0, 2.0, 50)]) == ["tokyo showed aiko 1.40 s back in time"]


def test_another_renderer_and_clocks_that_are_set_are_no_stale_motion() -> None:
    assert no_stale_motion([picture(2.5, 0.1, 40), picture(3.0, 2.0, 1)]) == []
    step = Span(2_900_000_000, 9_000_000_000)
    assert no_stale_motion([picture(2.5, 0.1, 40), picture(3.0, 2.0, 50)], [step]) == []


def test_memory_that_grew_and_processes_that_are_gone_are_found() -> None:
    before = {"hub/world": 200_000_000, "tokyo/renderer": 300_000_000, "hub/sim": 90_000_000}
    after = {"hub/world": 205_000_000, "tokyo/renderer": 360_000_000}
    assert memory_back(before, before) == []
    assert memory_back(before, after) == ["hub/sim: is not there at the end", "tokyo/renderer: 300.0 MB before, 360.0 MB after"]
    assert memory_back(before, after, 0.01, 0)[1] == "hub/world: 200.0 MB before, 205.0 MB after"


def test_files_that_stay_open_are_found() -> None:
    before = {"hub/world": 40, "tokyo/renderer": 30, "hub/sim": 20}
    assert files_back(before, {"hub/world": 40, "tokyo/renderer": 29}) == []
    assert files_back(before, before | {"hub/sim": 21}) == ["hub/sim: 20 files open before, 21 after"]


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("crashed process=hub/world signal=SIGKILL restart_in_s=0.0 log=x", []),
        ("crashed process=hub/world exit_code=1 restart_in_s=0.0 log=x", ["hub/world ended with 1"]),
        ("crashed process=tokyo/renderer signal=SIGKILL restart_in_s=0.0 log=x", ["tokyo/renderer ended with SIGKILL"]),
        ("crashed process=hub/world signal=SIGSEGV restart_in_s=0.0 log=x", ["hub/world ended with SIGSEGV"]),
    ],
)
def test_a_process_that_dies_unasked_is_found(tmp_path: Path, line: str, found: list[str]) -> None:
    log = tmp_path / "supervisor.log"
    faults = "event=fault name=world-failure target=hub/world seconds=0", "event=fault name=hang target=tokyo/renderer seconds=2"
    log.write_text("".join(f"2026-01-01 ERROR hub/supervisor {said}\n" for said in (*faults, line)))
    assert died(log) == found


@pytest.mark.parametrize("words", [("--minutes", "0"), ("--minutes", "-1"), ("--minutes", "nan"), ("--quiet", "-5")])
def test_a_time_that_cannot_be_is_refused_before_anything_starts(
    words: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["chaos", *words, "--out", str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert list(tmp_path.iterdir()) == []
