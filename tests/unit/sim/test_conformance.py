"""The suites of `vistel.testing.conformance`: VISTEL's simulators pass, what behaves otherwise does not."""

from __future__ import annotations

import json
import random
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner, Result

from vistel.testing import conformance
from vistel.testing.conformance import SUITES, Check, Line, NotApplicable, Target
from vistel.testing.conformance.ports import TcpLine
from vistel_cli.main import app
from vistel_sim.cyberglove import CyberGlove
from vistel_sim.device import Reply
from vistel_sim.fastrak import Fastrak
from vistel_sim.fivedt import Glove5, Glove16
from vistel_sim.liberty import Liberty
from vistel_sim.testing.conforming import SIMULATED, hand, pose, simulated
from vistel_sim.testing.instrument_line import InstrumentLine
from vistel_sim.testing.person import Gloves
from vistel_sim.testing.units import Pose, SerialUnit, VrpnUnit

PATIENCE = 15.0
"""Answers of a port may take thirty seconds: other work may keep every core busy."""
ONLY_SOMETIMES = {"it_comes_back_when_plugged_in_again", "reports_of_an_analog_device"}
"""Checks that VISTEL's own simulators do not always admit."""


def command(*words: str) -> Result:
    return CliRunner().invoke(app, ["testing", "check", *words], env={"COLUMNS": None})  # no terminal, no end of a line


def every_check() -> list[Check]:
    return [c for protocol in SUITES for c in conformance.checks(protocol)]


@pytest.fixture(scope="module", params=sorted(SUITES))
def target(request: pytest.FixtureRequest) -> Any:
    with simulated(request.param) as found:
        yield request.param, Target(found.device, found.baud, found.overwrite, found.unplugged, PATIENCE)


def test_every_suite_has_a_simulator_and_names_that_say_one_thing() -> None:
    assert SIMULATED.keys() == SUITES.keys()
    for protocol in SUITES:
        names = [c.name for c in conformance.checks(protocol)]
        assert len(set(names)) == len(names) and names[0] == "identification"
    for check in every_check():
        assert check.about.endswith("."), check.name
        assert re.fullmatch(r"[a-z_0-9]+", check.name)


def test_the_simulators_pass_every_check(target: tuple[str, Target]) -> None:
    outcomes = list(conformance.run(*target))
    assert [(o.name, o.line) for o in outcomes if o.verdict == "fail"] == []
    assert {o.name for o in outcomes if o.verdict == "skip"} <= ONLY_SOMETIMES
    assert all(o.line and "\n" not in o.line for o in outcomes)


class Altered:
    """A simulator of which something is altered: `change` gets what would be sent."""

    def __init__(self, unit: Any, change: Callable[[bytes], bytes]) -> None:
        self._unit, self._change = unit, change

    def __getattr__(self, name: str) -> Any:
        return getattr(self._unit, name)

    def measure(self, t_s: float) -> bytes:
        return self._change(self._unit.measure(t_s))

    def receive(self, data: bytes, t_s: float) -> list[Reply]:
        return [Reply(self._change(r.data), r.delay_s, r.baud) for r in self._unit.receive(data, t_s)]


def other_end(data: bytes) -> bytes:
    """Floats with the highest byte first."""
    if len(data) != 33 or not data.startswith(b"0"):
        return data
    return data[:3] + struct.pack(">7f", *struct.unpack("<7f", data[3:31])) + data[31:]


FASTRAK_FAULTS: dict[str, Callable[[bytes], bytes]] = {
    "identification": lambda data: data[:-3] + b"\r\n" if len(data) == 55 else data,
    "polled_text_records": lambda data: data.replace(b"04", b"03", 1) if data.startswith(b"04") else data,
    "binary_records": other_end,
    "errors_tell_position_field_and_station": lambda data: re.sub(rb"\*FL \d+", b"*FL 0", data),
    "unknown_commands_are_named": lambda data: data.replace(b"EC -99", b"EC -1"),
    "continuous_records_take_turns": lambda data: data.replace(b"02 ", b"01 ", 1) if data.startswith(b"02 ") else data,
    "settings_are_read_back": lambda data: data.replace(b"21G   5.00", b"21G   6.00"),
}
GLOVE_FAULTS: dict[str, Callable[[bytes], bytes]] = {
    "identification": lambda data: data.replace(b"CyberGlove", b"DataGlove"),
    "a_sample_on_request": lambda data: data[:5] + b"\0" + data[6:] if data.startswith(b"G") else data,
    "a_stream_until_stopped": lambda data: data[:-3] + data[-1:] if data.startswith(b"S") else data,
    "unknown_commands_are_named": lambda data: data.replace(b"e?", b"ok"),
}


@pytest.mark.parametrize("name", FASTRAK_FAULTS)
def test_a_fastrak_that_behaves_otherwise_fails_the_check_of_it(name: str) -> None:
    def line() -> Line:
        return InstrumentLine(Altered(Fastrak(pose, restart_s=0.3), FASTRAK_FAULTS[name]))

    assert {o.name: o.verdict for o in conformance.run("fastrak", line)}[name] == "fail"


@pytest.mark.parametrize("name", GLOVE_FAULTS)
def test_a_glove_that_behaves_otherwise_fails_the_check_of_it(name: str) -> None:
    def line() -> Line:
        return InstrumentLine(Altered(CyberGlove(hand, restart_s=0.3), GLOVE_FAULTS[name]))

    assert {o.name: o.verdict for o in conformance.run("cyberglove", line)}[name] == "fail"


def test_a_liberty_whose_stations_are_not_measured_together_fails() -> None:
    def spread(data: bytes) -> bytes:
        frames = [data[k : k + 42] for k in range(0, len(data), 42)] if len(data) % 42 == 0 else [data]
        return b"".join(f[:36] + bytes((f[2],)) + f[37:] if len(f) == 42 and f[2] else f for f in frames)

    outcomes = conformance.run("liberty", lambda: InstrumentLine(Altered(Liberty(pose, restart_s=0.3), spread)))
    assert {o.name: o.verdict for o in outcomes}["polled_records"] == "fail"


def test_what_does_not_identify_itself_is_asked_nothing_more() -> None:
    outcomes = list(conformance.run("fastrak", lambda: InstrumentLine(CyberGlove(hand))))
    assert [o.verdict for o in outcomes] == ["fail", *["skip"] * (len(outcomes) - 1)]


class Babbler(Line):
    """Says what nobody asked for. Its time passes while somebody reads."""

    def __init__(self, said: bytes) -> None:
        self._said, self._t_s = said, 0.0

    def write(self, data: bytes) -> None:
        pass

    def read(self, within_s: float) -> bytes:
        self._t_s += 0.02
        now, self._said = self._said[:37], self._said[37:]
        self._t_s += 0.0 if now else within_s
        return now

    def now_s(self) -> float:
        return self._t_s


@pytest.mark.parametrize("protocol", sorted(SUITES))
@given(said=st.binary(max_size=300))
@settings(max_examples=20, deadline=None)
def test_whatever_a_device_says_is_an_outcome_in_one_line(protocol: str, said: bytes) -> None:
    outcomes = list(conformance.run(protocol, lambda: Babbler(said)))
    assert outcomes[0].verdict == "fail"
    assert all("\n" not in o.line for o in outcomes)


@pytest.mark.parametrize(
    ("protocol", "unit"),
    [
        ("fastrak", lambda: Fastrak(pose, restart_s=0.3)),
        ("liberty", lambda: Liberty(pose, restart_s=0.3)),
        ("cyberglove", lambda: CyberGlove(hand, restart_s=0.3)),
        ("5dt_16", lambda: Glove16(hand)),
        ("5dt_5", lambda: Glove5(hand)),
    ],
)
@given(seed=st.integers(0, 2**32))
@settings(max_examples=5, deadline=None)
def test_a_device_on_a_noisy_line_is_found_faulty_and_ends_nothing(protocol: str, unit: Callable[[], Any], seed: int) -> None:
    rng = random.Random(seed)

    def noisy(data: bytes) -> bytes:
        at = rng.randrange(len(data)) if data and rng.random() < 0.1 else None
        return data if at is None else data[:at] + bytes((rng.randrange(256),)) + data[at + 1 :]

    outcomes = list(conformance.run(protocol, lambda: InstrumentLine(Altered(unit(), noisy))))
    assert len(outcomes) == len(conformance.checks(protocol))
    assert all("\n" not in o.line for o in outcomes)


def test_at_a_wrong_speed_nothing_is_understood() -> None:
    first = next(conformance.run("fastrak", lambda: InstrumentLine(Fastrak(pose), client_baud=9600)))
    assert first.verdict == "fail"


@pytest.mark.slow
def test_a_fastrak_at_a_serial_port_passes_and_may_be_pulled_out(simulated_fastrak: SerialUnit[dict[int, Pose]]) -> None:
    device = str(simulated_fastrak.path)
    outcomes = list(conformance.run("fastrak", Target(device, 0, True, simulated_fastrak.unplugged, PATIENCE)))
    assert [(o.name, o.line) for o in outcomes if o.verdict != "pass"] == []


@pytest.mark.slow
def test_a_glove_at_a_serial_port_passes_and_may_be_pulled_out(simulated_gloves: Gloves) -> None:
    unit = simulated_gloves.right
    outcomes = list(conformance.run("cyberglove", Target(unit.path, 0, True, unit.unplugged, PATIENCE)))
    assert [(o.name, o.line) for o in outcomes if o.verdict != "pass"] == []


def test_a_server_that_goes_away_is_seen_to_come_back(simulated_vrpn: VrpnUnit[dict[int, Pose]]) -> None:
    def line() -> Line:
        host, port = simulated_vrpn.address.partition("@")[2].split(":")
        return TcpLine(host, int(port))  # after it was unplugged it may have another port

    check = next(c for c in conformance.checks("vrpn") if c.name == "it_comes_back_when_plugged_in_again")
    assert "it answers" in check(Target(line, unplugged=simulated_vrpn.unplugged, patience=PATIENCE))


def test_checks_are_tests_of_pytest(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        test_mine="""
        import pytest
        from vistel.testing import conformance
        from vistel_sim.fastrak import Fastrak
        from vistel_sim.testing.conforming import pose
        from vistel_sim.testing.instrument_line import InstrumentLine

        @pytest.mark.parametrize("check", conformance.checks("fastrak"), ids=str)
        def test_my_simulator(check):
            check(lambda: InstrumentLine(Fastrak(pose, restart_s=0.3)))
        """
    )
    result = pytester.runpytest_inprocess("-p", "no:cacheprovider", "-v", "-rs")
    skipped = 2  # nobody can unplug it, and nobody allowed to overwrite its memory
    result.assert_outcomes(passed=len(SUITES["fastrak"].checks) - skipped, skipped=skipped)
    result.stdout.fnmatch_lines(["*test_my_simulator?identification? PASSED*"])


def test_a_check_raises_what_is_wrong() -> None:
    identification = conformance.checks("fastrak")[0]
    assert "stations 1 2 3 4" in identification(lambda: InstrumentLine(Fastrak(pose)))
    with pytest.raises(AssertionError, match="answer to S"):
        identification(lambda: InstrumentLine(CyberGlove(hand)))
    with pytest.raises(NotApplicable, match="nobody can unplug it"):
        conformance.checks("fastrak")[-1](lambda: InstrumentLine(Fastrak(pose)))


def test_the_command_lists_protocols_and_checks() -> None:
    protocols, checks = command(), command("fastrak")
    assert all(p in protocols.output for p in SUITES)
    assert all(c.name in checks.output for c in conformance.checks("fastrak"))


def test_the_command_prints_a_line_a_check_and_ends_well() -> None:
    done = command("cyberglove", "sim", "--json")
    assert done.exit_code == 0, done.output
    outcomes = [json.loads(line) for line in done.output.splitlines()]
    assert [o["name"] for o in outcomes] == [c.name for c in conformance.checks("cyberglove")]
    one = command("cyberglove", "sim", "--only", "it_restarts")
    assert [line.split()[:2] for line in one.output.splitlines()] == [["pass", "identification"], ["pass", "it_restarts"]]


WRONG = Path(__file__).stem


def wrong_fastrak() -> Line:
    """For the command: a FASTRAK that calls every wrong field the first."""
    return InstrumentLine(Altered(Fastrak(pose, restart_s=0.3), FASTRAK_FAULTS["errors_tell_position_field_and_station"]))


def no_line() -> str:
    return "no line"


def test_the_command_takes_an_object_of_a_module_and_fails_when_a_check_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parent)
    done = command("fastrak", f"{WRONG}:wrong_fastrak")
    assert done.exit_code == 1
    assert "fail errors_tell_position_field_and_station" in done.output and "p. 89" in done.output


@pytest.mark.parametrize(
    ("device", "expected", "code"),
    [
        ("/dev/no-such-port", "/dev/no-such-port: cannot be opened: No such file or directory", 1),
        ("127.0.0.1:1", "127.0.0.1:1: cannot be reached: Connection refused", 1),
        ("no_such_module:line", "no_such_module:line: cannot be imported: No module named 'no_such_module'", 1),
        (f"{WRONG}:no_such_name", "is no class or function that gives a line", 1),
        (f"{WRONG}:no_line", "gave a str, expected a vistel.testing.conformance.Line", 1),
        (__file__, "cannot be opened", 1),
    ],
)
def test_what_cannot_be_reached_is_named_in_one_line(
    device: str, expected: str, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parent)
    done = command("fastrak", device)
    assert done.exit_code == code
    assert expected in done.output and len(done.output.splitlines()) == 1


def test_wrong_words_are_named() -> None:
    assert command("fastrack", "sim").exit_code == 2
    assert "no suite of 'fastrack'; there are fastrak," in command("fastrack", "sim").output
    unknown = command("fastrak", "sim", "--only", "speed")
    assert unknown.exit_code == 2 and "no check of fastrak is called 'speed'" in unknown.output
