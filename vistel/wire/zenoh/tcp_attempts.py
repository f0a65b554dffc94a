"""After a cut: the attempts of a TLS session to connect begin anew many times a second, not when TCP sends its next packet.

An attempt that began during a cut sends its first packet again after 1 and 3 s, and Zenoh begins another one only when that has
failed. So while a session has no router, each attempt that nobody has answered for a little longer than a round trip is ended
here, and Zenoh begins the next one at once. On a link that has become slower than it was, none would be answered in time: so
connections of our own ask each router whether it is there, are given longer, and tell how long a round trip is now.

Zenoh's sockets are found by what the system shows of this process and of its network. Where it shows nothing, Zenoh is left alone.
"""

# zenoh's stubs leave return types out
# pyright: reportUnknownMemberType=false
import contextlib
import math
import os
import selectors
import socket
import sys
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import zenoh

from vistel.wire.zenoh.at_exit import started
from vistel.wire.zenoh.endpoints import host_and_port

LOOK_S = 0.1
"""Between two looks whether the session has a router [s]."""
ROUND_TRIPS = 1.25
"""An attempt may take so many round trips until it is answered ..."""
LEAST_S = 0.05
"""... at least this ... [s]"""
LONGEST_S = 3.0
"""... and at most this [s]."""
MOST_S = 0.5
"""The longest round trip that is believed of a good link, and that of one which is not known [s]."""
MEASURE = 100
"""Looks at a session that has a router between two at how long a round trip is."""
LATER_S = 0.5
"""An attempt may take this once nobody has answered for PATIENCE_S [s]."""
PATIENCE_S = 60.0
LOOKS = 4
"""At the sockets, in the time that an attempt may take."""
ASK_S = 2.0
"""Between two questions of our own [s]. A router of Zenoh's accepts nothing for 0.1 s after each that ends."""
ROUND_TRIP = slice(68, 72)
"""Where the round trip [us] is in Linux's `struct tcp_info`; 0: not measured."""
OPEN_FILES = Path("/proc/self/fd")
"""What this process has open, sockets too."""
CONNECTIONS = {socket.AF_INET: Path("/proc/self/net/tcp"), socket.AF_INET6: Path("/proc/self/net/tcp6")}
"""What the system knows of each TCP socket."""
ANSWERED = "01"
"""There: a socket that is connected."""
UNANSWERED = "02"
"""There: one that has no answer yet (SYN-SENT)."""

Address = tuple[socket.AddressFamily, str, int]


class TcpAttempts:
    """Of one session. Its thread runs from `watch` to `close`."""

    local = ""
    """The session may connect from any port."""

    def __init__(self, routers: Sequence[Address]) -> None:
        """Made by `attempts_for`."""
        self._routers = {_as_shown(a): a for a in routers}
        self._closed = threading.Event()

    def watch(self, session: zenoh.Session) -> None:
        """See to `session`, which has a router now."""
        run = threading.Thread(target=self._run, args=[session, self._round_trip_s()], name="bus attempts", daemon=True)
        started(run)

    def close(self) -> None:
        """Before the session is closed."""
        self._closed.set()

    def _run(self, session: zenoh.Session, round_trip_s: float) -> None:
        looks = 1
        while not self._closed.is_set():
            if not session.info.routers_zid():
                self._restart(_may_take_s(round_trip_s), lambda: self._closed.is_set() or bool(session.info.routers_zid()))
                looks = 0
            elif looks % MEASURE == 0:
                round_trip_s = self._round_trip_s()
            looks += 1
            self._closed.wait(LOOK_S)

    def _round_trip_s(self) -> float:
        """To the router, of the connections that there are [s]."""
        trips_s = [MOST_S]
        for connection in _sockets(self._routers):
            with contextlib.suppress(OSError), _opened(connection) as ours:
                trips_s += _round_trip_s(ours)
        return min(trips_s)

    def _restart(self, may_take_s: float, done: Callable[[], bool]) -> None:
        """End each attempt that takes longer, until `done`."""
        seen, looks, later_s = dict[int, int](), 0, PATIENCE_S
        with _Questions(list(self._routers.values())) as questions:
            while not done():
                look_s = may_take_s / LOOKS
                if looks * look_s > later_s:
                    may_take_s, later_s = LATER_S, math.inf
                may_take_s = max([may_take_s, *map(_may_take_s, questions.answered(look_s))])
                looks += 1
                attempts = {s.inode: s for s in _sockets(self._routers) if s.inode not in questions.inodes}
                if any(s.answered for s in attempts.values()):
                    questions.close()
                elif looks % round(ASK_S / look_s) == 0:
                    questions.ask()
                seen = {inode: seen.get(inode, looks) for inode, s in attempts.items() if not s.answered}
                for inode, since in seen.items():
                    if looks - since >= LOOKS:
                        _end(attempts[inode])


class _Questions:
    """One connection of our own to each router, which waits for an answer."""

    def __init__(self, routers: Sequence[Address]) -> None:
        self._routers = routers
        self._waiting: Any = selectors.DefaultSelector()  # its keys hold sockets, which its types do not say
        self.inodes = set[int]()
        """Of the sockets."""

    def __enter__(self) -> "_Questions":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
        self._waiting.close()

    def ask(self) -> None:
        """Ask each router anew."""
        self.close()
        for family, host, port in self._routers:
            asking = socket.socket(family)
            asking.setblocking(False)
            asking.connect_ex((host, port))
            self._waiting.register(asking, selectors.EVENT_WRITE)
            self.inodes.add(os.fstat(asking.fileno()).st_ino)

    def answered(self, within_s: float) -> list[float]:
        """The round trips [s] of the answers within that time."""
        found = list[float]()
        for key, _ in self._waiting.select(within_s):
            with contextlib.suppress(OSError):  # refused, or there is no way to it
                key.fileobj.getpeername()
                found += _round_trip_s(key.fileobj)
            self._end(key.fileobj)
        return found

    def close(self) -> None:
        """Wait for no answer any more."""
        for key in list(self._waiting.get_map().values()):
            self._end(key.fileobj)

    def _end(self, asking: socket.socket) -> None:
        self.inodes.discard(os.fstat(asking.fileno()).st_ino)
        self._waiting.unregister(asking)
        asking.close()


class _Socket(NamedTuple):
    """A TCP socket of this process."""

    inode: int
    descriptor: int
    answered: bool


def attempts_for(endpoints: Sequence[str]) -> TcpAttempts | None:
    """For a session with these endpoints; None where one is not over TLS, or its address or the system's sockets are not known."""
    shown = OPEN_FILES.exists() and all(path.exists() for path in CONNECTIONS.values())
    if not (shown and all(e.startswith("tls/") for e in endpoints)):
        return None
    try:
        found = [a for e in endpoints for a in socket.getaddrinfo(*host_and_port(e), type=socket.SOCK_STREAM)]
    except OSError:
        return None
    return TcpAttempts([(family, str(address[0]), int(address[1])) for family, _, _, _, address in found if family in CONNECTIONS])


def _as_shown(address: Address) -> str:
    """As the system shows the address of a connection."""
    family, host, port = address
    packed = socket.inet_pton(family, host.partition("%")[0])
    words = (int.from_bytes(packed[at : at + 4], sys.byteorder) for at in range(0, len(packed), 4))
    return "".join(f"{word:08X}" for word in words) + f":{port:04X}"


def _may_take_s(round_trip_s: float) -> float:
    """How long an attempt may take until it is answered over such a link [s]."""
    return min(max(ROUND_TRIPS * round_trip_s, LEAST_S), LONGEST_S)


def _round_trip_s(connected: socket.socket) -> list[float]:
    """As the system has measured it [s]; nothing where it has not."""
    told = connected.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, ROUND_TRIP.stop)
    trip_us = int.from_bytes(told[ROUND_TRIP], sys.byteorder)
    return [trip_us * 1e-6] if trip_us else []


def _sockets(routers: dict[str, Address]) -> Iterator[_Socket]:
    """Those of this process that lead to a router, answered or not."""
    states = dict[int, str]()
    for family in {family for family, _, _ in routers.values()}:
        for line in CONNECTIONS[family].read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] in (ANSWERED, UNANSWERED) and fields[2] in routers:
                states[int(fields[9])] = fields[3]
    for entry in OPEN_FILES.iterdir() if states else ():
        with contextlib.suppress(OSError):
            inode = entry.stat().st_ino
            if inode in states:
                yield _Socket(inode, int(entry.name), states[inode] == ANSWERED)


def _end(attempt: _Socket) -> None:
    """Make it fail now."""
    with contextlib.suppress(OSError), _opened(attempt) as ours:
        ours.shutdown(socket.SHUT_RDWR)


@contextlib.contextmanager
def _opened(found: _Socket) -> Generator[socket.socket]:
    """A handle of our own. Raises OSError where its descriptor has become another file's meanwhile."""
    with socket.socket(fileno=os.dup(found.descriptor)) as ours:
        if os.fstat(ours.fileno()).st_ino != found.inode:
            raise OSError(f"socket {found.inode} is closed")
        yield ours
