"""A session of Zenoh: opened over the first protocol that is answered, closed within a time."""

# zenoh's stubs leave return types out
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false
import asyncio
import logging
import threading
from collections.abc import Sequence

import zenoh

from vistel.wire.zenoh.at_exit import started
from vistel.wire.zenoh.config import TlsFiles, as_text, client_config
from vistel.wire.zenoh.endpoints import endpoint_fault
from vistel.wire.zenoh.gate import Gate, gate_for

log = logging.getLogger("vistel.bus")


class BusError(RuntimeError):
    """The bus cannot be reached; the text says where and what to check."""


async def open_session(endpoints: Sequence[str], tls: TlsFiles | None, connect_s: float) -> tuple[zenoh.Session, Gate | None]:
    """A session, and its gate where it has one. Raises BusError. Zenoh stays at an endpoint that takes packets and never answers:
    each protocol is tried by itself."""
    by_protocol: dict[str, list[str]] = {}
    for endpoint in endpoints:
        by_protocol.setdefault(endpoint.partition("/")[0], []).append(endpoint)
    failure: zenoh.ZError | None = None
    for protocol, group in by_protocol.items():
        gate = await asyncio.to_thread(gate_for, group)
        config = client_config(group, tls, connect_s / len(by_protocol), gate.local if gate is not None else "")
        try:
            session = await asyncio.to_thread(zenoh.open, zenoh.Config.from_json5(as_text(config)))
        except zenoh.ZError as e:
            failure = e
            continue
        if failure is not None:
            log.warning("no router answers over %s; %s is used, where losses delay motion", next(iter(by_protocol)), protocol)
        if gate is not None:
            gate.watch(session)
        return session, gate
    assert failure is not None
    raise BusError(no_router(endpoints, _unless_late(failure), " If so, the certificates do not match" if tls else "")) from failure


def no_router(endpoints: Sequence[str], why: str = "", hint: str = "") -> str:
    """What a user is told when no router answers."""
    return f"bus: no router answers at {', '.join(endpoints)}{why}; is it running there?{hint}"


def check_endpoints(endpoints: Sequence[str]) -> None:
    """Raises BusError for the first that is no address of a router."""
    for fault in filter(None, map(endpoint_fault, endpoints)):
        raise BusError(f"bus: the router's address {fault}")


def _unless_late(error: Exception) -> str:
    """The reason, in brackets, why a router does not answer, if it is another than that there is none."""
    why = reason(error)
    return "" if "Timeout" in why else f" ({why})"


def reason(error: Exception) -> str:
    """What Zenoh says, without the place in its source."""
    return str(error).split(" at /")[0].strip()


def close_session(session: zenoh.Session, deadline_s: float = 2.0) -> None:
    """Close; a close that hangs on a dead link is left to a thread that dies with the process."""
    if session.is_closed():
        return
    started(threading.Thread(target=session.close, daemon=True)).join(deadline_s)
