"""The gateway for guests: it vouches for who has the link of an invitation, and passes on what their page says as the device of
that seat and of no other. Everything that a page sends is checked here: who, how large, how often, in what range."""

from __future__ import annotations

import asyncio
import json
import logging
import secrets
import socket
from collections import defaultdict
from collections.abc import Callable
from contextlib import AbstractContextManager, closing, suppress
from functools import partial

from aiohttp import WSMsgType, web
from prometheus_client import Counter, Gauge

from vistel.audio.page_voice import VoiceGate, is_voice, voice_of
from vistel.conference.device_names import camera_body_name, headset_name, microphone_name, pointer_name
from vistel.conference.invitations import Invitation, RefusedError, invitations_in, invited
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.conference.seats import seat_place
from vistel.figure.body_model.builtin_people import PEOPLE
from vistel.protocol.pages.moved import moved, role_of
from vistel.protocol.pages.pointer import ASKED, LINE, PICTURE, guest_record, left_record
from vistel.protocol.pages.screen import PART
from vistel.protocol.pages.words import words_of
from vistel.session.chat import PrivateLines
from vistel.session.guest_lines import GuestLines, PrivateLinesSince
from vistel.session.guest_pages import GuestPages, Kept, NotTakenError
from vistel.session.guest_screen import MOST_RECORD_BYTES, PART_S, GuestScreen, ScreenError
from vistel.space.pages.sheet import MOST_BYTES, PageError
from vistel.wire import background
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep, within
from vistel_services.console.viewer import Viewer
from vistel_services.serving.server import prepared_socket

log = logging.getLogger("vistel.console")

_GUESTS = Gauge("vistel_console_guests_count", "Guests who are in the room by a browser")
_SPOKEN = Counter("vistel_console_guest_voice_packets_total", "Packets of guests' voices that were passed on")
_TAKEN = Counter("vistel_console_guest_messages_total", "Messages of guests' pages that were passed on")
_REFUSED = Counter("vistel_console_guest_refused_total", "Messages and links of guests' pages that were refused")

_MOST_SAID_BYTES = 3000
"""Of one message of a page: a line of 300 letters, each written as six."""
_PATIENCE_S = 10.0
"""A page shows its link within this time [s]."""
_GUESS_S = 1.0
"""A page whose link does not count holds its place among the strangers for so long [s]."""
_EVERY_NS = 20_000_000
"""A page's messages are passed on no oftener; it sends thirty a second, and what comes sooner is left out."""
MOST_A_SECOND = 200
"""Messages of a page, which sends 110; with more, it is none of ours, and is closed."""
COUNTED_S = 3
"""Messages are counted for so long: after page or gateway was held up, more come at once [s]."""
MOST_FAULTY = 10
"""The same of messages that say what nobody can do, in one visit."""
_PRESENT_S = 0.25
"""From one word that the guest is there to the next [s]."""
MOST_STRANGERS = 20
"""Pages that have not shown a link yet."""
_BEARER = "Bearer "
_NAMES = {"pointer": pointer_name, "camera_body": camera_body_name, "headset": headset_name}
_SAID = tuple(bytes((kind,)) for kind in (LINE, PICTURE, ASKED, PART))
"""Kinds of records for who takes a guest's voice, beside that."""

# With what a WebSocket is closed (RFC 6455 §7.4.2: codes of the application), so that a page does not come back by itself.
REFUSED = 4403
"""The link does not count."""
TAKEN = 4409
"""It is open at another page."""
ENDED = 4410
"""The invitation has ended, or was taken back."""
MISBEHAVED = 4429
"""The page sends what none of ours does."""

View = Callable[[web.WebSocketResponse, Viewer], AbstractContextManager[None]]
"""While entered, the room is sent there."""
ShowsLive = Callable[[str], bool]
"""Whether a panel shows a participant's screen."""


class Guests:
    """Lives on the event loop."""

    def __init__(self, conference: Conference, paths: RunPaths, bus: Bus, clock: Clock, view: View, shows_live: ShowsLive) -> None:
        self._conference, self._paths, self._bus, self._clock = conference, paths, bus, clock
        self._view, self._shows_live = view, shows_live
        self._visits: dict[str, _Visit] = {}
        self._kept = defaultdict[str, Kept](Kept)
        self._private = PrivateLinesSince(bus, clock)
        self._seats = {p.name for site in conference.sites for p in site.participants if p.by_link}
        self.people = {p.name for site in conference.sites for p in site.participants}
        """All who may be written to."""
        self._here: set[str] = set()
        self._strangers = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def close(self) -> None:
        """No guest is there any more."""
        self._socket.close()
        self._private.close()

    def may_read(self, request: web.Request) -> bool:
        """Whether a request for a figure or a thing shows the token of an invitation."""
        shown = request.headers.get("Authorization", "")
        with suppress(RefusedError):
            return shown.startswith(_BEARER) and bool(self._invited(shown.removeprefix(_BEARER)))
        return False

    async def visit(self, request: web.Request) -> web.StreamResponse:
        """The WebSocket of a guest's page."""
        connection, guest, hello = await self._admitted(request, _MOST_SAID_BYTES)
        if guest is not None and guest.participant in self._here:
            await _close(connection, TAKEN, "This link is open at another page already; close that one first.")
        elif guest is not None:
            self._here.add(guest.participant)
            self._kept[guest.participant].begin(hello.get("page"))
            _GUESTS.set(len(self._here))
            try:
                await self._visited(connection, guest)
            finally:
                self._here.discard(guest.participant)
                _GUESTS.set(len(self._here))
                self.pass_on(guest.participant, left_record())
        return connection

    async def screen(self, request: web.Request) -> web.StreamResponse:
        """The WebSocket on which a guest's page sends what it shows live. The stream ends with its panel, with the visit, and with
        the first picture that cannot be."""
        connection, guest, hello = await self._admitted(request, MOST_RECORD_BYTES + 1)  # aiohttp refuses what is as long as that
        visit = self._visits.get(guest.participant) if guest is not None else None
        if guest is None or visit is None or visit.shows_live:
            await _close(connection, REFUSED, "what a guest shows live comes from the page on which they have entered, once")
            return connection
        visit.shows_live = True
        try:
            stream = GuestScreen(hello, secrets.randbits(63))
            async for sent in connection:
                if self._visits.get(guest.participant) is not visit:
                    await connection.close(code=REFUSED)  # without a word: the page comes back, and shows on
                    break
                if not self._shows_live(guest.participant):
                    raise ScreenError("no panel shows it any more")
                for record in stream.records(sent.data, self.now_ns()):
                    self.pass_on(guest.participant, record)
                    await sleep(self._clock, PART_S)
        except ScreenError as fault:
            _REFUSED.inc()
            log.warning("event=guest_screen_ended participant=%s reason=%r", guest.participant, str(fault))
            await _close(connection, MISBEHAVED, f"{fault}")
        finally:
            visit.shows_live = False
            visit.pages.end_live()
        return connection

    async def show(self, request: web.Request) -> web.StreamResponse:
        """A picture that a guest's page sends, to be shown on a panel."""
        try:
            guest = self._invited(request.headers.get("Authorization", "").removeprefix(_BEARER))
        except RefusedError as fault:
            return web.Response(status=403, text=f"{fault}\n")
        visit = self._visits.get(guest.participant)
        if visit is None or not visit.entered:
            return web.Response(status=403, text="enter the room first\n")
        if visit.pages.full:
            return web.Response(status=429, text="too many pictures\n")
        async with visit.pages.uploading():  # from its first byte on: many at once would fill memory before any is looked at
            data = bytearray()
            async for piece in request.content.iter_any():
                data += piece
                if len(data) > MOST_BYTES:
                    return web.Response(status=413, text=f"expected at most {MOST_BYTES / 1e6:.1f} MB\n")
            try:
                return web.json_response({"pages": await visit.pages.take(bytes(data))})
            except PageError as fault:
                log.warning("event=guest_picture_refused participant=%s reason=%r", guest.participant, str(fault))
                return web.Response(status=415, text=f"{fault}\n")
            except NotTakenError as fault:
                return web.Response(status=503, text=f"{fault}\n")

    async def _admitted(
        self, request: web.Request, most_bytes: int
    ) -> tuple[web.WebSocketResponse, Invitation | None, dict[str, object]]:
        """A page's WebSocket, the invitation whose token it shows first, and all that it says then. most_bytes: of a message.
        Closes the connection where it shows none that counts."""
        if self._strangers >= MOST_STRANGERS:
            raise web.HTTPServiceUnavailable(text="too many pages open at once; try again\n")
        self._strangers += 1
        hello: dict[str, object] = {}
        try:
            connection = await prepared_socket(request, most_bytes)
            with suppress(TimeoutError, TypeError):
                async with within(self._clock, _PATIENCE_S):
                    hello = words_of(await connection.receive_str())
            try:
                return connection, self._invited(str(hello.get("token", ""))), hello
            except RefusedError as e:
                _REFUSED.inc()
                log.warning("event=guest_refused reason=%r", str(e))
                await sleep(self._clock, _GUESS_S)
                await _close(connection, REFUSED, str(e), e.why)
                return connection, None, hello
        finally:
            self._strangers -= 1

    def _invited(self, token: str) -> Invitation:
        try:
            guest = invited(invitations_in(self._paths.run), token, self._clock.now_ns())
        except (OSError, ValueError) as e:
            log.error("event=invitations_unreadable reason=%r", str(e))
            raise RefusedError("The host's machine cannot read its invitations; its log says why.", "unreadable") from e
        if guest.participant not in self._seats:
            raise RefusedError("The conference has no such seat any more. Ask the host for a new link.", "seat_gone")
        if not self._paths.device(pointer_name(guest.participant)).exists():
            raise RefusedError("The site of the guests does not run on the console's machine now. Tell the host.", "site_off")
        return guest

    async def _visited(self, connection: web.WebSocketResponse, guest: Invitation) -> None:
        place = await asyncio.to_thread(seat_place, self._conference.room, self._conference.seat_of(guest.participant))
        viewer = Viewer(guest.participant)
        words: dict[str, object] = {"kind": "invited", "participant": guest.participant, "name": guest.name, "avatar": guest.avatar}
        viewer.put("invited", json.dumps(words | {"people": sorted(PEOPLE), "seat": [*place[0].tolist(), place[1]]}))
        log.info("event=guest_came participant=%s", guest.participant)
        who, pass_on = guest.participant, partial(self.pass_on, guest.participant)
        pages = GuestPages(who, self._bus, self._clock, pass_on, self._kept[who])
        lines = GuestLines(who, self.people - {who}, self._bus, self._clock, pass_on)
        visit = _Visit(self, connection, guest, viewer, pages, lines, self._private.of(who, guest.digest))
        self._visits[guest.participant] = visit
        with self._view(connection, viewer), closing(pages), closing(lines):
            present = background.start(visit.stay(self._clock), "guest")
            try:
                await visit.listen()
            finally:
                present.cancel()
                del self._visits[guest.participant]
        log.info("event=guest_went participant=%s passed_on=%d", guest.participant, visit.passed_on)

    def still(self, guest: Invitation) -> bool:
        """Whether the invitation still counts: it has not ended, and no newer one took its place."""
        with suppress(OSError, ValueError):
            return guest.until_ns > self._clock.now_ns() and any(i.digest == guest.digest for i in invitations_in(self._paths.run))
        return True  # it counted; a file that is just being replaced ends no visit

    def now_ns(self) -> int:
        """Conference time."""
        return self._clock.now_ns()

    def pass_on(self, participant: str, record: bytes) -> None:
        """A record to the device or the microphone of this guest's seat."""
        for_microphone = is_voice(record) or record[2:3] in _SAID
        device = self._paths.device((microphone_name if for_microphone else _NAMES[role_of(record)])(participant))
        with suppress(OSError, ValueError):  # the device is not there now
            self._socket.sendto(record, ("127.0.0.1", int(device.read_text())))


class _Visit:
    """One guest at one page."""

    def __init__(
        self,
        gateway: Guests,
        connection: web.WebSocketResponse,
        guest: Invitation,
        viewer: Viewer,
        pages: GuestPages,
        lines: GuestLines,
        private: PrivateLines,
    ) -> None:
        self._gateway, self._connection, self._guest, self._viewer = gateway, connection, guest, viewer
        self.pages, self._lines, self._private = pages, lines, private
        self._voice = VoiceGate()
        self._avatar = ""
        self._passed_ns = dict.fromkeys(_NAMES, 0)
        self._since_ns, self._count, self._faulty, self.passed_on, self.shows_live = 0, 0, 0, 0, False

    @property
    def entered(self) -> bool:
        """Whether the guest has chosen a person, and is in the room. A page that comes back after a break may move and speak some
        time before it has said again as whom: this is left out, and no fault."""
        return bool(self._avatar)

    async def listen(self) -> None:
        """Take what the page says until it goes or misbehaves."""
        async for received in self._connection:
            now_ns = self._gateway.now_ns()
            if not self._in_time(now_ns):
                await _close(self._connection, MISBEHAVED, f"This page sent more than {MOST_A_SECOND} messages a second.")
                return
            if received.type is WSMsgType.TEXT:
                self._take_words(words_of(received.data), now_ns)
            elif received.type is WSMsgType.BINARY and is_voice(received.data):
                self._speak(received.data, now_ns)
            elif received.type is WSMsgType.BINARY:
                self._move(received.data, now_ns)
            if self._faulty > MOST_FAULTY:
                await _close(self._connection, MISBEHAVED, "This page says what nobody can do; load it again.")
                return

    async def stay(self, clock: Clock) -> None:
        """Say that the guest is there, until the invitation ends."""
        while self._gateway.still(self._guest):
            if self._avatar:
                self._gateway.pass_on(self._guest.participant, guest_record(self._guest.name, self._avatar))
            self._lines.again()
            for number, words in enumerate(self.pages.answers()):
                self._viewer.put(f"shown {number}", words)
            if heard := self.pages.kept.heard_words():
                self._viewer.put("heard", heard)
            if words := self._private.words():
                self._viewer.put("private", words)
            await sleep(clock, _PRESENT_S)
        await _close(self._connection, ENDED, "This invitation has ended, or the host has taken it back.")

    def _in_time(self, now_ns: int) -> bool:
        if now_ns - self._since_ns >= COUNTED_S * 1_000_000_000:
            self._since_ns, self._count = now_ns, 0
        self._count += 1
        return self._count <= COUNTED_S * MOST_A_SECOND

    def _take_words(self, words: dict[str, object], now_ns: int) -> None:
        """Words of the page: who is in the room may hear it; whoever asks is told the time. What has a number is done once."""
        if "n" in words and not (self.entered and self.pages.kept.hear(words["n"])):
            return
        if isinstance(words.get("time"), int | float):
            self._viewer.put("time", json.dumps({"kind": "time", "asked": words["time"], "ms": now_ns * 1e-6}))
        elif isinstance(words.get("hear"), bool):
            self._viewer.hears = bool(words["hear"] and self._avatar)
        elif isinstance(text := words.get("write"), str):
            if not (self.entered and self._lines.write(text, words.get("to", ""))):
                self._refuse()
        elif not (self.entered and self.pages.ask(words)):
            self._choose(words)

    def _choose(self, words: dict[str, object]) -> None:
        """Enter as a built-in person."""
        person = words.get("person")
        if isinstance(person, str) and person in PEOPLE:
            self._avatar = f"builtin:person={person}"
        elif person == "" and self._guest.avatar:
            self._avatar = self._guest.avatar
        else:
            self._refuse()

    def _move(self, record: bytes, now_ns: int) -> None:
        """What mouse and keys do, what the camera sees, or what the headset measures."""
        frame, role = moved(record, now_ns), role_of(record)
        if frame is None:
            self._refuse()
        elif self.entered and now_ns - self._passed_ns[role] >= _EVERY_NS:
            self._passed_ns[role] = now_ns
            self.passed_on += 1
            _TAKEN.inc()
            self._gateway.pass_on(self._guest.participant, record)

    def _speak(self, record: bytes, now_ns: int) -> None:
        voice = voice_of(record, now_ns)
        if voice is None:
            self._refuse()
        elif self.entered and self._voice.admits(voice[0], len(voice[1]), now_ns):
            _SPOKEN.inc()
            self._gateway.pass_on(self._guest.participant, record)

    def _refuse(self) -> None:
        self._faulty += 1
        _REFUSED.inc()


async def _close(connection: web.WebSocketResponse, code: int, reason: str, why: str = "") -> None:
    with suppress(ConnectionError, RuntimeError):
        await connection.send_str(json.dumps({"kind": "refused", "reason": reason, "code": code, "why": why}))
    await connection.close(code=code)
