"""The pytest plugin (entry point `pytest11`): simulated devices at real ports, links and whole conferences, for one test each."""

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pytest

from vistel_sim.testing.kept import keep, pytest_addoption, pytest_runtest_makereport

if TYPE_CHECKING:
    from vistel.v1.command_pb2 import Command
    from vistel_sim.testing.live_conference import LiveConference
    from vistel_sim.testing.network import Network
    from vistel_sim.testing.person import Gloves, Person
    from vistel_sim.testing.room_units import DelayUnit, Helmet, MicrophoneUnit
    from vistel_sim.testing.units import PhoneUnit, Pose, SerialUnit, Unit, VrpnUnit

__all__ = ["pytest_addoption", "pytest_runtest_makereport"]  # hooks of the plugin


class PlayLog(Protocol):
    """The fixture `recording`."""

    def __call__(self, log: Path | str, participant: str | None = None) -> "Person":
        """Somebody who moves as in `log`, by default its first participant: `.fastrak()`, `.gloves()`, ... start their devices.
        Raises MotionError, one line, for what is no log or has no such participant."""
        ...


class StartTracker(Protocol):
    """The fixture `simulated_tracker`."""

    def __call__(self, kind: str, **keys: object) -> "SerialUnit[dict[int, Pose]]":
        """A tracker of a kind, also one of another package, on a serial port; keys: as in a conference file."""
        ...


class StartConference(Protocol):
    """The fixture `conference`."""

    def __call__(self, file: Path | str | None = None, *, renderers: bool = False) -> "LiveConference":
        """A conference that runs: of a file, of the text of one, or of two people at two sites. renderers: whether its sites draw;
        without them, files that it names are given by their whole paths."""
        ...


class InSimulatedTime(Protocol):
    """A conference whose time passes only when a test lets it. log: a log like any other, whole up to now after each `live`."""

    log: Path

    @property
    def now_s(self) -> float:
        """Seconds since it began."""
        ...

    def live(self, seconds: float) -> None:
        """Let so many seconds of the conference pass."""
        ...

    def live_until(self, condition: Callable[[], bool], what: str, *, within_s: float = 60.0) -> None:
        """Let it pass until `condition` holds; AssertionError names `what` it waited for."""
        ...

    def ask(self, participant: str, command: "Command") -> None:
        """A command of a participant, now. Raises KeyError for an unknown one."""
        ...

    def end(self) -> None:
        """End it, and close its log; it ends with the test otherwise."""
        ...


class StartSimulatedConference(Protocol):
    """The fixture `simulated_conference`."""

    def __call__(self, file: Path | str | None = None, *, faults: Iterable[str] = ()) -> InSimulatedTime:
        """A conference of a file, of the text of one, or of two people at two sites. faults: DEVICE:KIND:AT_S:FOR_S. Raises
        ConferenceError or ValueError, one line."""
        ...


@pytest.fixture
def simulated_fastrak(tmp_path: Path, request: pytest.FixtureRequest) -> "Iterator[SerialUnit[dict[int, Pose]]]":
    """A Polhemus FASTRAK with four receivers on somebody who moves; `.path` is its serial port."""
    with _person(tmp_path, request) as person:
        yield person.fastrak()


@pytest.fixture
def simulated_tracker(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[StartTracker]:
    """Starts a tracker of any kind that has a serial port: `simulated_tracker("liberty").path`, or a kind of your own package."""
    from vistel.conference.devices import TrackerConfig

    started = 0
    with ExitStack() as ends:

        def start(kind: str, **keys: object) -> "SerialUnit[dict[int, Pose]]":
            nonlocal started
            started += 1
            config = TrackerConfig.model_validate({"kind": kind, **keys})
            return ends.enter_context(_person(tmp_path / str(started), request, tracker=config)).fastrak()

        yield start


@pytest.fixture
def simulated_gloves(tmp_path: Path, request: pytest.FixtureRequest) -> "Iterator[Gloves]":
    """Two CyberGloves: `.left.path` and `.right.path` are their serial ports."""
    with _person(tmp_path, request) as person:
        yield person.gloves()


@pytest.fixture
def simulated_vrpn(tmp_path: Path, request: pytest.FixtureRequest) -> "Iterator[VrpnUnit[dict[int, Pose]]]":
    """A VRPN server with a tracker; `.address` is DEVICE@127.0.0.1:PORT."""
    from vistel.conference.devices import TrackerConfig

    with _person(tmp_path, request, tracker=TrackerConfig(kind="vrpn")) as person:
        yield person.vrpn()


@pytest.fixture
def simulated_phone(tmp_path: Path, request: pytest.FixtureRequest) -> "Iterator[PhoneUnit[dict[str, float]]]":
    """A phone with Live Link Face that sends UDP packets to `.address`."""
    from vistel.conference.devices import FaceConfig

    with _person(tmp_path, request, face=FaceConfig(port="sim")) as person:
        yield person.phone()


@pytest.fixture
def simulated_helmet(tmp_path: Path, request: pytest.FixtureRequest) -> "Iterator[Helmet]":
    """A helmet with two cameras: `.face.address` and `.eye.address` stream JPEG pictures over HTTP."""
    from vistel.conference.devices import EyeConfig, FaceConfig

    with _person(tmp_path, request, face=FaceConfig(kind="camera"), eye=EyeConfig()) as person:
        yield person.helmet()


@pytest.fixture
def simulated_microphone(tmp_path: Path, request: pytest.FixtureRequest) -> "Iterator[MicrophoneUnit]":
    """A microphone into which somebody speaks; `.path` is a pipe with 16-bit samples, mono, 48 kHz."""
    with _person(tmp_path, request) as person:
        yield person.microphone()


@pytest.fixture
def simulated_delay_unit(tmp_path: Path, request: pytest.FixtureRequest) -> "Iterator[DelayUnit]":
    """An audio delay unit on Modbus TCP; `.address` is 127.0.0.1:PORT."""
    from vistel.wire.clock import SystemClock
    from vistel_sim.equipment.delay_unit import SimulatedDelayUnit
    from vistel_sim.testing.room_units import DelayUnit

    clock, announce = SystemClock(), tmp_path / "dev" / "delay-unit"
    start_ns = clock.now_ns()
    with ExitStack() as ends:
        unit = DelayUnit(SimulatedDelayUnit("delay-unit", announce, clock, start_ns), clock, start_ns, announce)
        ends.callback(unit.end)
        keep(request, tmp_path, lambda folder: _logs(folder, [unit]))
        unit.wait_until_plugged()
        yield unit


@pytest.fixture
def recording(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[PlayLog]:
    """Plays a log into simulated devices: `recording(LOG, "aiko").fastrak()` is a FASTRAK on somebody who moves as aiko did."""
    from vistel_sim.testing.person import logged

    played_so_far = 0
    with ExitStack() as ends:

        def played(log: Path | str, participant: str | None = None) -> "Person":
            nonlocal played_so_far
            played_so_far += 1
            folder = tmp_path / "recording" / str(played_so_far)
            person = logged(Path(log), participant, folder)
            ends.callback(person.end)
            keep(request, folder, lambda into: _logs(into, person.units))
            return person

        yield played


@pytest.fixture
def network() -> "Iterator[Network]":
    """Links with delay, jitter, loss and cuts: connect to `network.tcp(PORT, Conditions(delay_s=0.05)).port` instead of PORT."""
    from vistel_sim.testing.network import Network

    links = Network()
    try:
        yield links
    finally:
        links.end()


@pytest.fixture
def conference(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[StartConference]:
    """Starts whole conferences: `conference()` is one of two people at two sites, `conference("mine.toml")` that of a file."""
    from vistel_sim.testing.live_conference import LiveConference, without_renderers

    with ExitStack() as ends:
        started: list[LiveConference] = []

        def start(file: Path | str | None = None, *, renderers: bool = False) -> LiveConference:
            name = f"conference-{len(started) + 1}" if started else "conference"
            path, text = _conference_file(file, tmp_path / f"{name}.toml")
            if not (path.exists() and renderers):
                path = tmp_path / f"{name}.toml"
                path.write_text(text if renderers else without_renderers(text), "utf-8")
            running = LiveConference(path, tmp_path / name)
            ends.callback(running.end)
            keep(request, tmp_path, lambda folder: running.kept())
            started.append(running)
            running.wait_until_running()
            return running

        yield start


@pytest.fixture
def simulated_conference(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[StartSimulatedConference]:
    """Whole conferences in simulated time: `simulated_conference().live(60.0)` computes a minute of two people, always the same."""
    # Simulators know no services. What joins both is named, as the command is to start a live conference.
    simulated = import_module("vistel_cli.testing.simulated_conference").SimulatedConference
    started = 0
    with ExitStack() as ends:

        def start(file: Path | str | None = None, *, faults: Iterable[str] = ()) -> InSimulatedTime:
            nonlocal started
            started += 1
            path, text = _conference_file(file, tmp_path / f"simulated-{started}.toml")
            if not path.exists():
                path.write_text(text, "utf-8")
            running: InSimulatedTime = simulated.of_file(path, tmp_path / f"simulated-{started}.mcap", faults)
            ends.callback(running.end)
            keep(request, tmp_path, lambda folder: [running.log])
            return running

        yield start


def _conference_file(given: Path | str | None, otherwise: Path) -> tuple[Path, str]:
    """A file that was given and its text; or a text, by default that of two people, and `otherwise`, where it is to be written."""
    from vistel_sim.testing.live_conference import TWO

    if isinstance(given, Path) or (given is not None and "\n" not in given):
        return Path(given), Path(given).read_text("utf-8")
    return otherwise, given or TWO


@contextmanager
def _person(folder: Path, request: pytest.FixtureRequest, **worn: Any) -> "Generator[Person]":
    """Somebody in a meeting, whose devices end with the block and whose logs are kept when the test fails. Their ports are in a
    folder of the fixture's: a test may use several fixtures."""
    from vistel_sim.testing.person import Person

    _tell_of_compiling(request)
    own = folder / str(request.fixturename)
    person = Person(own, **worn)
    keep(request, own, lambda into: _logs(into, person.units))
    try:
        yield person
    finally:
        person.end()


def _tell_of_compiling(request: pytest.FixtureRequest) -> None:
    """One line where the first simulated device on this machine takes a minute."""
    from vistel.jit.kernel_jit import is_cold
    from vistel_sim import rotations

    plugins = request.config.pluginmanager
    terminal: Any = plugins.get_plugin("terminalreporter")
    capture: Any = plugins.get_plugin("capturemanager")
    if terminal is not None and is_cold(rotations.turned):
        with capture.global_and_fixture_disabled() if capture else nullcontext():
            terminal.ensure_newline()
            terminal.write_line("VISTEL compiles its simulated devices: about a minute, and only once")
            terminal.flush()


def _logs(folder: Path, units: "list[Unit[Any, Any]]") -> list[Path]:
    """The log of each unit, written into the folder."""
    written: list[Path] = []
    folder.mkdir(parents=True, exist_ok=True)
    for unit in units:
        if lines := unit.log():
            written.append(folder / f"{unit.name}.log")
            written[-1].write_text("\n".join(lines) + "\n", "utf-8")
    return written
