"""A suite of checks of one protocol, run against any implementation of the device's side."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, Literal, TypeVar

from vistel.testing.conformance.line import Line, LineError, NonconformityError, NotApplicable, Talk
from vistel.testing.conformance.ports import TcpLine, opener

Verdict = Literal["pass", "fail", "skip"]


@dataclass(frozen=True)
class Target:
    """An implementation under test.

    device: a serial port, "host:port", "Tracker0@host:port" for a device of a VRPN server, "module:object" for a class or function
    without arguments that gives a `Line`, or such a thing itself. baud: of its serial port; 0: the protocol's usual one. overwrite:
    whether what it keeps when it is switched off may be overwritten. unplugged: a block within which it cannot be reached; None:
    nobody can unplug it. patience: how many times longer than usual it may take to answer.
    """

    device: str | Path | Callable[[], Line]
    baud: int = 0
    overwrite: bool = False
    unplugged: Callable[[], AbstractContextManager[None]] | None = None
    patience: float = 1.0

    @property
    def name(self) -> str:
        """Of the device at a server, what stands before "@"; else empty."""
        name, at, _ = str(self.device).partition("@")
        return name if at and not callable(self.device) else ""


@dataclass(frozen=True)
class Session:
    """An open talk with the target, and how another one is opened."""

    talk: Talk
    target: Target
    open: Callable[[], Talk]

    @property
    def on_network(self) -> bool:
        """Whether the line is a TCP connection."""
        return isinstance(self.talk.line, TcpLine)


class Unit(ABC):
    """A device with which a check talks, in the state that its suite begins with."""

    def __init__(self, session: Session) -> None:
        self.talk, self.target, self.open = session.talk, session.target, session.open

    @abstractmethod
    def begin(self) -> None:
        """Bring the device to the state that every check begins with. Raises NonconformityError."""

    @abstractmethod
    def end(self) -> None:
        """Leave the device silent."""

    def comes_back(self, ask: Callable[[], object]) -> str:
        """Unplug the device and plug it in again; `ask` asks it something. Raises NonconformityError when it answers while it is
        unplugged, or not afterwards, NotApplicable when nobody can unplug it."""
        if self.target.unplugged is None:
            raise NotApplicable("not tried: nobody can unplug it")
        with self.target.unplugged():
            try:
                ask()
            except (LineError, NonconformityError):
                pass
            else:
                raise NonconformityError("it answers while it is unplugged")
        self.talk = self.open()
        ask()
        return "unplugged and plugged in: it answers"


U = TypeVar("U", bound=Unit)


@dataclass(frozen=True)
class Outcome:
    """Of one check. section: of the manual; line: what was found, or what is wrong, or why it was not tried."""

    name: str
    section: str
    verdict: Verdict
    line: str


@dataclass(frozen=True)
class Check:
    """One check. Call it with a target (or with what `Target.device` takes): it returns a line about what was found."""

    protocol: str
    name: str
    section: str
    about: str
    _try: Callable[[Target], str] = field(repr=False)

    def __call__(self, target: Target | str | Path | Callable[[], Line]) -> str:
        """Raises NonconformityError (an AssertionError) when the device does not do what its protocol says, NotApplicable (for
        pytest a skipped test) when this cannot be tried with it, LineError when it cannot be reached."""
        return self._try(target if isinstance(target, Target) else Target(target))

    def __str__(self) -> str:
        return self.name


class Suite(Generic[U]):
    """The checks of a protocol. The first one is identification: when it fails, the others are not tried."""

    def __init__(self, protocol: str, title: str, baud: int, unit: Callable[[Session], U]) -> None:
        """title: of the manual that sections are of. baud: the usual speed of a serial line."""
        self.protocol = protocol
        self.title = title
        self.baud = baud
        self.checks: list[Check] = []
        self._unit = unit

    def check(self, section: str = "") -> Callable[[Callable[[U], str]], Callable[[U], str]]:
        """Make a function the next check; its name is the check's, its docstring says what is expected."""

        def add(body: Callable[[U], str]) -> Callable[[U], str]:
            about = (body.__doc__ or "").strip()
            self.checks.append(Check(self.protocol, body.__name__, section, about, lambda target: self._try(body, target)))
            return body

        return add

    def run(self, target: Target, only: Collection[str] = ()) -> Iterator[Outcome]:
        """All outcomes, each as soon as it is known. only: names of checks beside the first; none: all. Raises LineError when the
        device cannot be reached at first."""
        opener(target.device, target.baud or self.baud)().close()
        unknown = ""
        for check in (c for k, c in enumerate(self.checks) if not (k and only) or c.name in only):
            if unknown:
                yield Outcome(check.name, check.section, "skip", unknown)
                continue
            outcome = _outcome(check, target)
            yield outcome
            if outcome.verdict == "fail" and check is self.checks[0]:
                unknown = "not tried: it did not identify itself"

    def _try(self, body: Callable[[U], str], target: Target) -> str:
        open_line = opener(target.device, target.baud or self.baud)
        with ExitStack() as ends:

            def opened() -> Talk:
                line = open_line()
                ends.callback(line.close)
                return Talk(line, target.patience)

            unit = self._unit(Session(opened(), target, opened))
            unit.begin()
            try:
                return body(unit)
            finally:
                unit.end()


def _outcome(check: Check, target: Target) -> Outcome:
    try:
        return Outcome(check.name, check.section, "pass", check(target))
    except NotApplicable as e:
        return Outcome(check.name, check.section, "skip", str(e))
    except (NonconformityError, LineError) as e:
        return Outcome(check.name, check.section, "fail", str(e))
