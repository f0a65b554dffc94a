"""What the studios' pages ask: who may, and how it is answered. Everybody who reaches the port may edit files, so requests of other
pages (Origin) and under other names (Host) are refused."""

import json
import logging
from collections.abc import Set
from typing import Any

from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

from vistel.wrinkle.errors import WrinkleError

log = logging.getLogger("vistel.studio")

_SAFE = {
    "Content-Security-Policy": "default-src 'self'; connect-src 'self' blob:; img-src 'self' blob: data:; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class RequestError(Exception):
    """A request that cannot be fulfilled; one line for the page."""

    def __init__(self, text: str, status: int = 400) -> None:
        super().__init__(text)
        self.status = status


def guard(hosts: Set[str]) -> Middleware:
    """hosts: names and ports under which the pages are served."""

    @web.middleware
    async def guarded(request: web.Request, handler: Handler) -> web.StreamResponse:
        if request.headers.get("Host", "") not in hosts:
            return _said("this address is not the studio's; open the one that it printed", 403)
        origin = request.headers.get("Origin")
        if origin is not None and origin not in {f"http://{host}" for host in hosts}:
            return _said("asked for by another page", 403)
        if request.method == "POST" and request.content_type not in ("application/json", "application/octet-stream"):
            return _said("expected JSON", 415)
        try:
            response = await handler(request)
        except RequestError as fault:
            return _said(str(fault), fault.status)
        except web.HTTPRedirection:
            raise
        except web.HTTPException as fault:
            return _said(fault.reason, fault.status)
        except (WrinkleError, OSError) as fault:
            log.info("event=refused path=%s reason=%r", request.path, str(fault))
            return _said(str(fault), 400)
        except Exception:
            log.exception("event=request_failed path=%s", request.path)
            return _said("the studio could not do this; its log says more", 500)
        if not response.prepared:
            response.headers.update(_SAFE)
        return response

    return guarded


async def read_json(request: web.Request) -> dict[str, Any]:
    """The JSON object of a request. Raises RequestError."""
    try:
        data = json.loads(await request.text())
    except (ValueError, UnicodeDecodeError, RecursionError) as fault:
        raise RequestError(f"not JSON: {fault}") from fault
    if not isinstance(data, dict):
        raise RequestError("expected a JSON object")
    return data


def _said(text: str, status: int) -> web.Response:
    return web.json_response({"error": text}, status=status, headers=_SAFE)
