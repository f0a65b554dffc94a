"""Requests with JSON to a lease store. An answer that never comes is given up by who asks."""

from __future__ import annotations

import asyncio
import json
import ssl
from collections.abc import Sequence
from typing import Any

import aiohttp

from vistel.wire.lease.lease import LeaseStoreError


class Requests:
    """One connection to the first of `addresses` that answers; the next one after a failure."""

    def __init__(self, addresses: Sequence[str], tls: ssl.SSLContext | None = None) -> None:
        self._addresses, self._tls = list(addresses), tls
        self._session: aiohttp.ClientSession | None = None

    async def ask(
        self, method: str, path: str, body: Any = None, headers: dict[str, str] | None = None, accept: Sequence[int] = (200,)
    ) -> tuple[int, Any]:
        """The status, one of `accept`, and the answer's JSON. Raises LeaseStoreError."""
        if self._session is None:
            self._session = aiohttp.ClientSession(connector=aiohttp.TCPConnector(ssl=self._tls or True))
        address = self._addresses[0]
        try:
            async with self._session.request(method, address + path, json=body, headers=headers) as answer:
                text = await answer.text()
                if answer.status in accept:
                    return answer.status, json.loads(text)
                reason = f"{answer.status} {text[:200].strip()}"
        except asyncio.CancelledError:  # no answer in time
            self._addresses.append(self._addresses.pop(0))
            raise
        except (aiohttp.ClientError, OSError, ValueError) as e:
            reason = str(e)
        self._addresses.append(self._addresses.pop(0))
        raise LeaseStoreError(f"{address}: {reason}")

    async def close(self) -> None:
        """Close the connection."""
        if self._session is not None:
            await self._session.close()
            self._session = None
