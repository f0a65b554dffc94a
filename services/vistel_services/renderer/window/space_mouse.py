"""A 3D mouse on USB for a window: found when it is plugged in, missed and found again; nobody has to have one."""

import logging

from vistel.devices.transport import Transport, TransportError
from vistel.devices.transport.hid import HidDevice, find_hid, open_hid
from vistel.protocol.space_mouse import FULL, LOGITECH, THREE_DCONNEXION, SpaceMouseState, after, is_space_mouse
from vistel.render.interaction.navigation import Deflection
from vistel.wire.clock import Clock

log = logging.getLogger("vistel.renderer")

LOOK_NS = 5_000_000_000
"""How often one is looked for."""
STILL = 0.05
"""A cap that is off its middle by no more than this is not touched: springs do not come back to the count."""


class SpaceMouse:
    """Call `look` every so often; `deflection` says how it is pushed."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._open = open_hid(_find, clock)
        self._transport: Transport | None = None
        self._state = SpaceMouseState()
        self._looked_ns: int | None = None

    @property
    def deflection(self) -> Deflection:
        """How it is pushed and turned, along and about right, up and towards one."""
        return Deflection(_turned(self._state.push), _turned(self._state.turn))

    def look(self) -> None:
        """Look for one where there is none."""
        now_ns = self._clock.now_ns()
        if self._transport is not None or (self._looked_ns is not None and now_ns - self._looked_ns < LOOK_NS):
            return
        first, self._looked_ns = self._looked_ns is None, now_ns
        try:
            self._transport = self._open(self._received, self._lost)
            log.info("event=space_mouse state=found")
        except TransportError as e:
            if first:
                log.info("event=space_mouse state=none reason=%r", str(e))

    def close(self) -> None:
        """Leave it."""
        if self._transport is not None:
            self._transport.close()
            self._transport = None

    def _received(self, report: bytes, _t_ns: int) -> None:
        self._state = after(self._state, report)

    def _lost(self, reason: str) -> None:
        log.info("event=space_mouse state=lost reason=%r", reason)
        self._transport, self._state = None, SpaceMouseState()


def _find() -> HidDevice:
    """The first of either vendor's."""
    try:
        return find_hid(THREE_DCONNEXION, lambda product: is_space_mouse(THREE_DCONNEXION, product), "a 3D mouse")()
    except TransportError as first:
        if "is not on USB" not in str(first):
            raise
        return find_hid(LOGITECH, lambda product: is_space_mouse(LOGITECH, product), "a 3D mouse")()


def _turned(counts: tuple[int, int, int]) -> tuple[float, float, float]:
    """The device's right, towards and down as right, up and towards, -1 to 1, none near the middle."""
    right, towards, down = (0.0 if abs(c) <= STILL * FULL else c / FULL for c in counts)
    return right, -down, towards
