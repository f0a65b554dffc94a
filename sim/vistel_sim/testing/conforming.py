"""VISTEL's own simulators, as the suites of `vistel.testing.conformance` check them."""

import math
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from vistel.arrays import F64
from vistel.protocol.vrpn import SIMULATED as SIMULATED_TRACKER
from vistel.testing.conformance import Target
from vistel.wire.clock import SystemClock
from vistel_sim.cyberglove import CyberGlove
from vistel_sim.equipment.delay_unit import SimulatedDelayUnit
from vistel_sim.fastrak import Fastrak
from vistel_sim.fivedt import Glove5, Glove16
from vistel_sim.liberty import Liberty
from vistel_sim.simulation import RESTART_S
from vistel_sim.testing.instrument_line import InstrumentLine
from vistel_sim.testing.room_units import DelayUnit
from vistel_sim.testing.units import VrpnUnit
from vistel_sim.vrpn_server import SimulatedVrpn, Tracker


def pose(station: int, t_s: float) -> tuple[F64, F64]:
    """Receivers of nobody that turn slowly, in the transmitter's frame: position [m], quaternion (x, y, z, w)."""
    half = 0.1 * station + 0.05 * t_s
    return np.array((0.4 + 0.05 * station, 0.1, -0.5)), np.array((0.0, 0.0, math.sin(half), math.cos(half)))


def hand(t_s: float) -> list[float]:
    """A hand that slowly closes and opens: 20 angles [rad], order of `Posture.hands`."""
    return [0.3 + 0.2 * math.sin(t_s + k) for k in range(20)]


@contextmanager
def fastrak() -> Generator[Target]:
    yield Target(lambda: InstrumentLine(Fastrak(pose, restart_s=RESTART_S)), overwrite=True)


@contextmanager
def liberty() -> Generator[Target]:
    yield Target(lambda: InstrumentLine(Liberty(pose, restart_s=RESTART_S)))


@contextmanager
def patriot() -> Generator[Target]:
    yield Target(lambda: InstrumentLine(Liberty(pose, model="patriot", restart_s=RESTART_S)))


@contextmanager
def cyberglove() -> Generator[Target]:
    yield Target(lambda: InstrumentLine(CyberGlove(hand, sensors=22, right=True, restart_s=RESTART_S)))


@contextmanager
def glove_16() -> Generator[Target]:
    yield Target(lambda: InstrumentLine(Glove16(hand), 19200))


@contextmanager
def glove_5() -> Generator[Target]:
    yield Target(lambda: InstrumentLine(Glove5(hand), 19200))


@contextmanager
def vrpn() -> Generator[Target]:
    with TemporaryDirectory() as folder:
        clock, announce = SystemClock(), Path(folder) / "port"
        start_ns = clock.now_ns()
        server = SimulatedVrpn("tracker", SIMULATED_TRACKER, Tracker(pose, (1, 2, 3, 4)), announce, clock, start_ns)
        unit = VrpnUnit(server, clock, start_ns, lambda t_s: {n: pose(n, t_s) for n in (1, 2, 3, 4)}, announce, SIMULATED_TRACKER)
        try:
            unit.wait_until_plugged()
            yield Target(unit.address)
        finally:
            unit.end()


@contextmanager
def delay_unit(baud: int = 0) -> Generator[Target]:
    """baud: of a serial line; 0: by TCP."""
    with TemporaryDirectory() as folder:
        clock, announce = SystemClock(), Path(folder) / "unit"
        start_ns = clock.now_ns()
        unit = DelayUnit(SimulatedDelayUnit("delay", announce, clock, start_ns, baud=baud), clock, start_ns, announce)
        try:
            unit.wait_until_plugged()
            yield Target(unit.address, baud)
        finally:
            unit.end()


SIMULATED: dict[str, Callable[[], AbstractContextManager[Target]]] = {
    "fastrak": fastrak,
    "liberty": liberty,
    "patriot": patriot,
    "cyberglove": cyberglove,
    "5dt_16": glove_16,
    "5dt_5": glove_5,
    "vrpn": vrpn,
    "delay_unit": delay_unit,
}
"""By protocol. Within the block the simulator can be reached."""


def simulated(protocol: str) -> AbstractContextManager[Target]:
    """The simulator of a protocol that there is a suite of."""
    return SIMULATED[protocol]()
