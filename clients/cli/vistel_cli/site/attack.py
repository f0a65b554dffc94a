"""`vistel doctor --attack`: attacks one's own running router, each with the least that an attacker needs, and tells what it stops.

Nothing sent here harms a meeting if it gets through: messages are of no version that a service reads, and participants of no name.
"""

from __future__ import annotations

import json
import socket
import ssl
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from vistel.conference.model import HUB_PLACE, Conference
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.common_names import common_name, revoked_names
from vistel.wire.zenoh.config import TlsFiles, as_text, client_config
from vistel.wire.zenoh.endpoints import host_and_port
from vistel_cli.site.certificate_folder import authority_of
from vistel_cli.terminal import FAILED, fail, load_conference, out

if TYPE_CHECKING:
    from vistel.wire.certificates.authority import Authority

MARK = b"vistel doctor"
"""Attached to what is sent here, so that it is known when it arrives."""
WAIT_S = 1.0
"""For what should not arrive."""
QUESTIONS = 200
"""Of a flood."""


@dataclass(frozen=True)
class Attempt:
    """stopped: None where it could not be tried."""

    who: str
    tries: str
    stopped: bool | None


def report(file: Path, as_json: bool) -> int:
    """Attack, and print what happened. Returns the exit code."""
    conference = load_conference(file)
    authority = authority_of(conference)
    endpoint = next((e for e in conference.bus.endpoints if e.startswith("tls/")), "")
    if not endpoint:
        fail(f"{file}: bus.endpoints: expected tls/HOST:PORT, where the router listens")
    with tempfile.TemporaryDirectory() as folder, ExitStack() as open_sessions:
        attempts = _Attacker(conference, authority, endpoint, Path(folder), open_sessions).all()
    if as_json:
        print(json.dumps({"attempts": [asdict(a) for a in attempts]}))
    else:
        words = {True: ("stopped", "green"), False: ("SUCCEEDED", "red"), None: ("not tried", "yellow")}
        table = Table("who", "tries", "", box=None)
        for a in attempts:
            word, colour = words[a.stopped]
            table.add_row(a.who, a.tries, Text(word, colour))
        out.print(table)
    return FAILED if any(a.stopped is False for a in attempts) else 0


class _Attacker:
    def __init__(self, conference: Conference, authority: Authority, endpoint: str, folder: Path, sessions: ExitStack) -> None:
        self._authority, self._endpoint, self._folder, self._sessions = authority, endpoint, folder, sessions
        self._name = conference.name
        self._revoked = revoked_names(authority.folder)
        sites = [s.name for s in conference.sites if s.name not in conference.world.all and s.name not in conference.hosts.values()]
        self._site = next(iter(sites), "")
        self._other = next((s.name for s in conference.sites if s.name != self._site), "")
        self._observer = next(iter(conference.observers), "")

    def all(self) -> list[Attempt]:
        """Of the least privilege first."""
        from vistel.wire.certificates.authority import Authority
        from vistel.wire.certificates.signer import TOKEN

        now = datetime.now(UTC)
        host, port = host_and_port(self._endpoint)
        try:
            socket.create_connection((host, port), 3.0).close()
        except OSError as e:
            fail(f"{self._endpoint}: no router answers ({e.strerror or e}); start it with vistel site router")
        foreign = Authority.create(self._folder / "foreign", now).issue(self._site or "nobody", now)
        old = self._certificate(self._site or "nobody", valid=timedelta(seconds=-1))
        found = [
            Attempt("anybody", "to connect without TLS", self._no_link(None, f"tcp/{host}:{port}")),
            Attempt("anybody", "to connect without a certificate", self._refused(None)),
            Attempt("anybody", "to connect with a certificate of another authority", self._refused(foreign)),
            Attempt("a site", "to connect with a certificate that has expired", self._refused(old)),
        ]
        hub = self._session(self._certificate(common_name(HUB_PLACE, self._revoked)))
        if not self._site:
            fail("every site of the file runs a world or has a host, who may do more: there is nobody to attack as")
        site = self._session(self._certificate(common_name(self._site, self._revoked)))
        if not self._heard(hub, site, self._about(self._site)):
            fail("no message of a site is heard by the hub, which it should be: is this router of this conference file?")
        nobody = self._session(self._certificate("vistel-doctor"))
        found.append(Attempt("a name that is not listed", "to speak", not self._heard(hub, nobody, self._about("vistel-doctor"))))
        found.append(Attempt("a name that is not listed", "to ask for the time", not self._answers(nobody, "clock")))
        gone = self._session(self._certificate(self._revoked[-1])) if self._revoked else None
        found.append(Attempt("a revoked certificate", "to ask for the time", gone and not self._answers(gone, "clock")))
        if self._other:
            found.append(Attempt("a site", "to speak as another site", not self._heard(hub, site, self._about(self._other))))
            found.append(Attempt("a site", "to be present as another site", not self._present(hub, site)))
        signs = bool(list(hub.liveliness().get(f"vistel/{self._name}/alive/{HUB_PLACE}/{TOKEN}", timeout=WAIT_S)))
        for who, session in (("a site", site), ("an observer", self._observer and self._listening())):
            if not session:
                found.append(Attempt(who, "to speak", None))
                continue
            if who == "an observer":
                found.append(Attempt(who, "to speak", not self._heard(hub, session, self._about(self._observer))))
            found.append(Attempt(who, "to speak as the world", not self._heard(hub, session, self._key("world_state"))))
            other = self._answers(session, "certificate", holder=self._other) if signs and self._other else None
            found.append(Attempt(who, "to get another's certificate by renewing it", None if other is None else not other))
            for topic, what in (("world_save", "to get the private state of the room"), ("world_handover", "to take the room")):
                runs = self._answers(hub, "world_save")
                found.append(Attempt(who, what, not self._answers(session, topic) if runs else None))
        flood = self._flood(site) if self._answers(site, "world_snapshot") else None
        found.append(Attempt("a site", f"to have {QUESTIONS} questions for the room answered at once", flood))
        return found

    def _key(self, topic: str) -> str:
        return BY_NAME[topic].pattern(self._name)

    def _about(self, site: str) -> str:
        return BY_NAME["participant"].pattern(self._name, site=site, participant="vistel-doctor")

    def _certificate(self, name: str, valid: timedelta = timedelta(hours=1)) -> TlsFiles:
        """Kept nowhere but in the temporary folder."""
        from cryptography.hazmat.primitives.asymmetric import ec

        from vistel.wire.certificates.authority import write_key

        key = ec.generate_private_key(ec.SECP256R1())
        files = TlsFiles(self._authority.file, self._folder / f"{name}.pem", self._folder / f"{name}.key")
        files.certificate.write_bytes(self._authority.signed(name, key.public_key(), datetime.now(UTC), valid=valid))
        write_key(files.key, key)
        return files

    def _listening(self) -> Any:
        return self._session(self._certificate(common_name(self._observer, self._revoked)))

    def _session(self, files: TlsFiles) -> Any:
        import zenoh

        session = zenoh.open(zenoh.Config.from_json5(as_text(client_config([self._endpoint], files))))
        self._sessions.callback(session.close)
        return session

    def _no_link(self, files: TlsFiles | None, endpoint: str) -> bool:
        import zenoh

        try:
            zenoh.open(zenoh.Config.from_json5(as_text(client_config([endpoint], files, connect_s=1.0)))).close()
        except zenoh.ZError:
            return True
        return False

    def _refused(self, files: TlsFiles | None) -> bool:
        """Whether the router ends a handshake with this certificate, or none."""
        tls = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        tls.load_verify_locations(self._authority.file)
        if files is not None:
            tls.load_cert_chain(files.certificate, files.key)
        host, port = host_and_port(self._endpoint)
        try:
            with socket.create_connection((host, port), 3.0) as plain, tls.wrap_socket(plain, server_hostname=host) as link:
                link.settimeout(WAIT_S)
                return link.recv(1) == b""
        except TimeoutError:
            return False
        except OSError:
            return True

    def _heard(self, hub: Any, sender: Any, key: str) -> bool:
        """Whether the hub hears what `sender` says under a key."""
        marked: list[object] = []

        def arrived(sample: Any) -> None:
            if sample.attachment is not None and sample.attachment.to_bytes() == MARK:
                marked.append(sample)

        subscriber = hub.declare_subscriber(key, arrived)
        found = _within(WAIT_S, lambda: bool(marked), lambda: sender.put(key, b"", attachment=MARK))
        subscriber.undeclare()
        return found

    def _present(self, hub: Any, sender: Any) -> bool:
        key = f"vistel/{self._name}/alive/{self._other}/vistel-doctor"
        token = sender.liveliness().declare_token(key)
        found = _within(WAIT_S, lambda: bool(list(hub.liveliness().get(key, timeout=0.3))))
        token.undeclare()
        return found

    def _answers(self, session: Any, topic: str, **names: str) -> bool:
        key = BY_NAME[topic].pattern(self._name, **names)
        return any(reply.ok is not None for reply in session.get(key, timeout=WAIT_S))

    def _flood(self, session: Any) -> bool:
        asked = [session.get(self._key("world_snapshot"), timeout=WAIT_S) for _ in range(QUESTIONS)]
        return sum(reply.ok is not None for answers in asked for reply in answers) < QUESTIONS / 2


def _within(seconds: float, true: Callable[[], bool], again: Callable[[], None] = lambda: None) -> bool:
    """Whether something becomes true in time, while something is done again and again."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        again()
        if true():
            return True
        time.sleep(0.05)
    return False
