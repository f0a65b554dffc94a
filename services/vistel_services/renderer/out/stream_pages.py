"""The pages of a stream, and who may read it: people type its token once, into a form, and are known by a cookie from then on;
programs send it with each request. It never stands in an address, which browsers and proxies keep."""

from __future__ import annotations

import hmac
import logging
from importlib import resources

from aiohttp import web

from vistel.wire.clock import Clock
from vistel_services.renderer.out.stream_address import StreamAddress, answered

log = logging.getLogger("vistel.renderer")

_FOLDER = resources.files("vistel_services.renderer.out") / "page"
SERVED = {"/": ("index.html", "text/html"), "/watch.js": ("watch.js", "text/javascript"), "/watch.css": ("watch.css", "text/css")}
"""Files and their kinds, by path."""
_FORM = "token.html"
_NEEDED_BY_FORM = "/watch.css"
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
    "form-action 'self'; frame-ancestors 'none'; base-uri 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",  # with "no-referrer" browsers do not say of which page a form is
    "Cache-Control": "no-cache",
}
_SAID_EACH_NS = 60_000_000_000
_PROGRAM = "Bearer "


class StreamPages:
    """address: with its port, once that is known; names: DNS names of its certificate, at which it is found beside those of the
    machine."""

    def __init__(self, address: StreamAddress, names: frozenset[str], clock: Clock) -> None:
        self.address, self._names, self._clock = address, names, clock
        self._refused, self._said_ns = 0, -_SAID_EACH_NS
        # What the cookie holds: other servers of the machine get to see it, and must not learn the token.
        self._ticket = hmac.digest(address.token.encode(), b"vistel stream, cookie", "sha256").hex()

    async def page(self, request: web.Request) -> web.Response:
        """What is at a path of `SERVED`."""
        self.check_place(request)
        if request.path == "/" and not self._admits(request):
            return self._form()
        if request.path != _NEEDED_BY_FORM:
            self.check_token(request)
        name, kind = SERVED[request.path]
        return web.Response(text=(_FOLDER / name).read_text("utf-8"), content_type=kind, charset="utf-8", headers=_HEADERS)

    def check_place(self, request: web.Request) -> None:
        """Answer 403 to what is meant for another server, or comes from a page of one."""
        host, origin = request.headers.get("Host"), request.headers.get("Origin")
        if not answered(host, origin, self._names):
            self._refuse(request, f"host {host!r}, origin {origin!r}")
            raise web.HTTPForbidden(text="the stream is for its own page only; ask for that by the address of its machine\n")

    def check_token(self, request: web.Request) -> None:
        """Answer 403 to who shows neither token nor cookie."""
        if not self._admits(request):
            self._refuse(request, "no token")
            raise web.HTTPForbidden(text="this stream asks for its token: open its page, or send Authorization: Bearer TOKEN\n")

    async def enter(self, request: web.Request) -> web.Response:
        """Take the form: a cookie for the token, and on to the page."""
        self.check_place(request)
        shown = (await request.post()).get("token")
        if not (isinstance(shown, str) and self.address.token and _same(shown.strip(), self.address.token)):
            self._refuse(request, "wrong token")
            return self._form(wrong=True)
        entered = web.Response(status=303, headers={"Location": "/", "Cache-Control": "no-store"})
        secure = self.address.certificate is not None
        entered.set_cookie(self._cookie, self._ticket, httponly=True, samesite="Strict", secure=secure, path="/")
        return entered

    def _admits(self, request: web.Request) -> bool:
        shown = request.headers.get("Authorization", "")
        return (
            not self.address.token
            or _same(request.cookies.get(self._cookie, ""), self._ticket)
            or (shown.startswith(_PROGRAM) and _same(shown.removeprefix(_PROGRAM), self.address.token))
        )

    def _form(self, *, wrong: bool = False) -> web.Response:
        text = (_FOLDER / _FORM).read_text("utf-8")
        said = "This is not the token." if wrong else "This picture asks for a token. Whoever runs the conference has it."
        return web.Response(
            status=403, text=text.replace("{said}", said), content_type="text/html", charset="utf-8", headers=_HEADERS
        )

    @property
    def _cookie(self) -> str:
        """Its name: browsers have one set of cookies for all ports of a machine."""
        return f"{'' if self.address.certificate is None else '__Host-'}vistel_{self.address.port}"

    def _refuse(self, request: web.Request, why: str) -> None:
        """A line a minute: who asks often must not fill the log."""
        self._refused += 1
        now_ns = self._clock.steady_ns()
        if now_ns - self._said_ns >= _SAID_EACH_NS:
            log.warning("event=stream_refused by=%s reason=%r refused=%d", request.remote, why, self._refused)
            self._said_ns, self._refused = now_ns, 0


def _same(shown: str, wanted: str) -> bool:
    """In a time that tells nothing of where they differ."""
    return hmac.compare_digest(shown.encode("utf-8", "surrogateescape"), wanted.encode())
