"""After a cut: a QUIC session connects anew as soon as its router can be reached, not when a handshake's next packet is due.

A handshake that began during a cut sends its first packet again after one and three seconds, and Zenoh begins another one only
when that has failed. So while a session has no router, the local port from which its QUIC connections come is kept in use here,
which makes Zenoh's attempts fail at once, and from that port the routers are asked twenty times a second whether they are there.
When one answers, the port is left to Zenoh.

The question is a packet of a version that nobody speaks. Who listens for QUIC answers it and keeps nothing of it (RFC 9000,
section 6: version negotiation). Where no router does, or the system does not show a process its sockets, Zenoh is left alone.
"""

# zenoh's stubs leave return types out
# pyright: reportUnknownMemberType=false
import contextlib
import math
import os
import secrets
import socket
import stat
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import zenoh

from vistel.wire.zenoh.at_exit import started
from vistel.wire.zenoh.config import OPEN_MS
from vistel.wire.zenoh.endpoints import host_and_port

LOOK_S = 0.1
"""Between two looks whether the session has a router [s]."""
BEGUN_S = 0.02
"""Between two looks whether Zenoh has begun an attempt [s]."""
ATTEMPT_S = OPEN_MS / 1000.0 + 0.5
"""An attempt of Zenoh has ended after so long, well or not [s]."""
ASK_S = 0.05
"""Between two questions [s]."""
LATER_S = 0.25
"""The same once nobody has answered for PATIENCE_S [s]."""
PATIENCE_S = 60.0
"""Without an answer for so long, Zenoh may try all the same [s]."""
FIRST_S = 2.0
"""So long it is found out whether routers answer such questions at all [s]."""
JUNK = 64
"""Packets that are no answers, read at most between two questions."""
PORTS = range(20_000, 32_768)
"""Below those that systems give to whoever asks for any: nobody takes ours between two attempts."""
PORT_TRIES = 100
"""Ports looked at."""
LEAST_BYTES = 1200
"""A shorter packet is not answered (RFC 9000, section 14.1)."""
NO_VERSION = bytes.fromhex("1a2a3a4a")
"""Of those reserved to be spoken by nobody (RFC 9000, section 15)."""
NEGOTIATES = bytes(4)
"""In the place of the version: an answer to such a question."""
ID_BYTES = 8
"""Of the names by which both sides know the question."""
OPEN_FILES = Path("/proc/self/fd")
"""What this process has open, sockets too."""


def question(name: bytes) -> bytes:
    """A packet that who listens for QUIC answers. name: of who asks, ID_BYTES."""
    ids = b"".join(bytes([ID_BYTES]) + part for part in (secrets.token_bytes(ID_BYTES), name))
    return (b"\xc0" + NO_VERSION + ids).ljust(LEAST_BYTES, b"\0")


def is_answer(packet: bytes, name: bytes) -> bool:
    """Whether a packet answers the question of `name`."""
    return packet[:1] >= b"\x80" and packet[1:].startswith(NEGOTIATES + bytes([ID_BYTES]) + name)


class Gate:
    """Of one session. Its thread runs from `watch` to `close`."""

    def __init__(self, routers: Sequence[tuple[str, int]], family: socket.AddressFamily, port: int) -> None:
        """Made by `gate_for`. routers: their addresses. port: from which the session connects."""
        self.local = f"[::]:{port}" if family is socket.AF_INET6 else f"0.0.0.0:{port}"
        self._routers = routers
        self._family = family
        self._port = port
        self._name = secrets.token_bytes(ID_BYTES)
        self._closed = threading.Event()

    def watch(self, session: zenoh.Session) -> None:
        """See to `session`, which connects from the port and has a router now."""
        started(threading.Thread(target=self._run, args=[session], name="bus gate", daemon=True))

    def close(self) -> None:
        """Before the session is closed."""
        self._closed.set()

    def _run(self, session: zenoh.Session) -> None:
        with socket.socket(self._family, socket.SOCK_DGRAM) as elsewhere:
            if not self._reached(elsewhere, FIRST_S, ASK_S):
                return
        seen, every_s = 0, ASK_S
        while not self._closed.is_set():
            held = self._of_zenoh(seen)
            if held is None:
                self._closed.wait(BEGUN_S)
                continue
            with held:
                seen = os.fstat(held.fileno()).st_ino
                self._until(lambda: bool(session.info.routers_zid()), ATTEMPT_S)
                self._until(lambda: not session.info.routers_zid())
                every_s = ASK_S if self._reached(held, PATIENCE_S, every_s) else LATER_S

    def _until(self, holds: Callable[[], bool], most_s: float = math.inf) -> None:
        """Wait until something holds, at most for so long, or until `close`."""
        looks = 0
        while looks * LOOK_S < most_s and not self._closed.is_set() and not holds():
            self._closed.wait(LOOK_S)
            looks += 1

    def _of_zenoh(self, seen: int) -> socket.socket | None:
        """A second handle of the socket from which Zenoh connects, which keeps the port in use when Zenoh has closed its own. None
        where there is none but that whose number was `seen`."""
        for entry in OPEN_FILES.iterdir():
            with contextlib.suppress(OSError):
                file = entry.stat()
                if not stat.S_ISSOCK(file.st_mode) or file.st_ino == seen:
                    continue
                found = socket.socket(fileno=os.dup(int(entry.name)))
                ours = found.family is self._family and found.type is socket.SOCK_DGRAM
                if ours and found.getsockname()[1] == self._port:
                    return found
                found.close()
        return None

    def _reached(self, asking: socket.socket, most_s: float, every_s: float) -> bool:
        """Ask until a router answers, at most for so long. Whether one did."""
        asking.settimeout(every_s)
        for _ in range(round(most_s / every_s)):
            if self._closed.is_set():
                break
            for router in self._routers:
                with contextlib.suppress(OSError):  # this machine has no network
                    asking.sendto(question(self._name), router)
            with contextlib.suppress(TimeoutError):
                for _ in range(JUNK):
                    if is_answer(asking.recv(LEAST_BYTES), self._name):
                        return True
        return False


def gate_for(endpoints: Sequence[str]) -> Gate | None:
    """For a session with these endpoints; None where one is not over QUIC, has settings of its own, or its address is not known."""
    if not (OPEN_FILES.exists() and all(e.startswith("quic/") and "#" not in e for e in endpoints)):
        return None
    try:
        found = [socket.getaddrinfo(*host_and_port(e), type=socket.SOCK_DGRAM)[0] for e in endpoints]
    except OSError:
        return None
    family = found[0][0]
    port = _unused(family)
    if port is None or any(other is not family for other, *_ in found):
        return None
    return Gate([(str(address[0]), int(address[1])) for *_, address in found], family, port)


def _unused(family: socket.AddressFamily) -> int | None:
    """A port that nobody uses; None where none was found."""
    for _ in range(PORT_TRIES):
        port = PORTS[secrets.randbelow(len(PORTS))]
        with socket.socket(family, socket.SOCK_DGRAM) as s, contextlib.suppress(OSError):
            s.bind(("", port))
            return port
    return None
