"""Pages, and who may read them: people type the token once, into a form, and are known by a cookie from then on; programs send it
with each request. It never stands in an address, which browsers and proxies keep."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import PurePath

from aiohttp import web
from aiohttp.typedefs import Handler

from vistel.wire.clock import Clock
from vistel_services.serving.address import PageAddress, answered

log = logging.getLogger("vistel.serving")

_FORM = resources.files("vistel_services.serving") / "page"
_KINDS = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",  # with "no-referrer" browsers do not say of which page a form is
    "Cache-Control": "no-cache",
}
STYLE_OF_FORM = "/token.css"
_SAID_EACH_NS = 60_000_000_000
_PROGRAM = "Bearer "
_FORWARDED = {"forwarded", "via", "x-forwarded-for"}
"""Headers of a proxy."""
STEERS = web.RequestKey("steers", bool)
"""Of a request that was admitted: whether it is the host's."""
_POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"


@dataclass(frozen=True)
class PageFiles:
    """What a server shows. what: "stream", in refusals and in its log; served: files of `folder` by path, "/" among them; policy:
    what its pages may load, as a Content-Security-Policy, beside scripts and styles of the server itself; also: whether a request
    may be answered without the token, by another right."""

    what: str
    folder: Traversable
    served: Mapping[str, str]
    policy: str
    also: Callable[[web.Request], bool] = lambda request: False


class Pages:
    """address: with its port, once that is known; names: DNS names of its certificate, at which it is found beside those of the
    machine."""

    def __init__(self, files: PageFiles, address: PageAddress, names: frozenset[str], clock: Clock) -> None:
        self._files, self.address, self._names, self._clock = files, address, names, clock
        self._refused, self._said_ns = 0, -_SAID_EACH_NS

    async def page(self, request: web.Request) -> web.Response:
        """What is at a path of the served ones. 404 where that file is missing."""
        self.check_place(request)
        if request.path == STYLE_OF_FORM:
            return self._answer((_FORM / "token.css").read_text("utf-8"), ".css")
        if request.path == "/" and not self._admits(request):
            return self._form()
        self.check_token(request)
        name = self._files.served[request.path]
        try:
            data = await asyncio.to_thread((self._files.folder / name).read_bytes)
        except FileNotFoundError as e:
            raise web.HTTPNotFound(text=f"{name} is not there\n") from e
        answer = self._answer(data.decode("utf-8"), PurePath(name).suffix)
        answer.etag = hashlib.sha256(data).hexdigest()
        if answer.etag in (request.if_none_match or ()):
            return web.Response(status=304, headers=_HEADERS | {"ETag": str(answer.headers["ETag"])})
        answer.enable_compression()
        return answer

    def check_place(self, request: web.Request) -> None:
        """Answer 403 to what is meant for another server, or comes from a page of one."""
        host, origin = request.headers.get("Host"), request.headers.get("Origin")
        if not answered(host, origin, self._names):
            self._refuse(request, f"host {host!r}, origin {origin!r}")
            raise web.HTTPForbidden(
                text=f"the {self._files.what} is for its own page only; ask for that by the address of its machine\n"
            )

    def check_token(self, request: web.Request) -> None:
        """Answer 403 to who shows neither token nor cookie."""
        if not self._admits(request):
            self._refuse(request, "no token")
            raise web.HTTPForbidden(
                text=f"this {self._files.what} asks for its token: open its page, or send Authorization: Bearer TOKEN\n"
            )

    def admitting(self, handler: Handler) -> Handler:
        """The handler, for whom the pages admit."""

        async def checked(request: web.Request) -> web.StreamResponse:
            self.check_place(request)
            self.check_token(request)
            request[STEERS] = self._is_host(request)
            return await handler(request)

        return checked

    async def enter(self, request: web.Request) -> web.Response:
        """Take the form: a cookie for the token, and on to the page."""
        self.check_place(request)
        shown, known = (await request.post()).get("token"), (self.address.token, self.address.host_token)
        token = next((t for t in known if t and isinstance(shown, str) and _same(shown.strip(), t)), "")
        if not token:
            self._refuse(request, "wrong token")
            return self._form(wrong=True)
        entered = web.Response(status=303, headers={"Location": "/", "Cache-Control": "no-store"})
        secure = self.address.certificate is not None
        entered.set_cookie(self._cookie, _ticket(token), httponly=True, samesite="Strict", secure=secure, path="/")
        return entered

    def _admits(self, request: web.Request) -> bool:
        token, host = self.address.token, self.address.host_token
        return not token or self._shows(request, token) or self._shows(request, host) or self._files.also(request)

    def _is_host(self, request: web.Request) -> bool:
        """Who shows the host's token; where the file has no token at all, who is at this machine and did not come by a proxy."""
        if self.address.token:
            return self._shows(request, self.address.host_token)
        return self.address.local and not _FORWARDED & {name.lower() for name in request.headers}

    def _shows(self, request: web.Request, token: str) -> bool:
        shown = request.headers.get("Authorization", "")
        by_program = shown.startswith(_PROGRAM) and _same(shown.removeprefix(_PROGRAM), token)
        return bool(token) and (by_program or _same(request.cookies.get(self._cookie, ""), _ticket(token)))

    def _form(self, *, wrong: bool = False) -> web.Response:
        text = (_FORM / "token.html").read_text("utf-8")
        said = "This is not the token." if wrong else "This page asks for a token. Whoever runs the conference has it."
        return self._answer(text.replace("{said}", said), ".html", 403)

    def _answer(self, text: str, ending: str, status: int = 200) -> web.Response:
        policy = {"Content-Security-Policy": f"{_POLICY}; {self._files.policy}"}
        return web.Response(status=status, text=text, content_type=_KINDS[ending], charset="utf-8", headers=_HEADERS | policy)

    @property
    def _cookie(self) -> str:
        """Its name: browsers have one set of cookies for all ports of a machine."""
        return f"{'' if self.address.certificate is None else '__Host-'}vistel_{self.address.port}"

    def _refuse(self, request: web.Request, why: str) -> None:
        """A line a minute: who asks often must not fill the log."""
        self._refused += 1
        now_ns = self._clock.steady_ns()
        if now_ns - self._said_ns >= _SAID_EACH_NS:
            log.warning("event=%s_refused by=%s reason=%r refused=%d", self._files.what, request.remote, why, self._refused)
            self._said_ns, self._refused = now_ns, 0


def _ticket(token: str) -> str:
    """What the cookie holds: other servers of the machine get to see it, and must not learn the token."""
    return hmac.digest(token.encode(), b"vistel stream, cookie", "sha256").hex()


def _same(shown: str, wanted: str) -> bool:
    """In a time that tells nothing of where they differ."""
    return hmac.compare_digest(shown.encode("utf-8", "surrogateescape"), wanted.encode())
