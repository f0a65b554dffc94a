"""A lease in etcd, through its JSON gateway (etcd 3.4 and later, "gRPC gateway" of its documentation).

Three keys under vistel/CONFERENCE/: `leader` is bound to the lease and goes when it ends; `term` and `led` stay.
"""

from __future__ import annotations

import secrets
import ssl
from base64 import b64decode, b64encode
from collections.abc import Sequence
from typing import Any

from vistel.wire.lease.lease import Holder, LeaseStoreError
from vistel.wire.lease.requests import Requests


class EtcdLease:
    """See `Lease`."""

    lasts_s = 5.0

    def __init__(self, addresses: Sequence[str], conference: str, place: str, tls: ssl.SSLContext | None = None) -> None:
        """addresses: of the members of one etcd, "http://host:port"."""
        self._requests = Requests(addresses, tls)
        self._prefix, self._place, self._name = f"vistel/{conference}/", place, f"{place} {secrets.token_hex(8)}"
        self._id = "0"
        self._term = -1

    async def holder(self) -> Holder:
        """As `Lease.holder`."""
        end = self._prefix[:-1] + chr(ord("/") + 1)
        answer = await self._ask("kv/range", {"key": _encoded(self._prefix), "range_end": _encoded(end)})
        try:
            found = {b64decode(kv["key"]).decode(): b64decode(kv.get("value", "")).decode() for kv in answer.get("kvs", ())}
            led_term, led_place = found.get(self._prefix + "led", "-1 ").split(" ")
            term = int(found.get(self._prefix + "term", "-1"))
            return Holder(term, self._prefix + "leader" in found, int(led_term), led_place)
        except (KeyError, ValueError) as e:
            raise LeaseStoreError(f"etcd: {self._prefix} holds no lease of a room; remove it") from e

    async def acquire(self, seen: Holder, term: int) -> bool:
        """As `Lease.acquire`."""
        self._id = (await self._ask("lease/grant", {"TTL": str(round(self.lasts_s))}))["ID"]
        unchanged = self._is("term", str(seen.term)) if seen.term >= 0 else self._absent("term")
        taken = await self._if(
            [self._absent("leader"), unchanged], [self._put("leader", self._name, self._id), self._put("term", str(term))]
        )
        self._term = term if taken else self._term
        if not taken:
            await self.release()
        return taken

    async def renew(self) -> bool:
        """As `Lease.renew`."""
        return int((await self._ask("lease/keepalive", {"ID": self._id})).get("result", {}).get("TTL", "0")) > 0

    async def note_led(self) -> bool:
        """As `Lease.note_led`."""
        return await self._if([self._is("leader", self._name)], [self._put("led", f"{self._term} {self._place}")])

    async def release(self) -> None:
        """As `Lease.release`."""
        await self._ask("lease/revoke", {"ID": self._id}, accept=(200, 404))

    async def close(self) -> None:
        """As `Lease.close`."""
        await self._requests.close()

    async def _if(self, compare: list[Any], then: list[Any]) -> bool:
        answer = await self._ask("kv/txn", {"compare": compare, "success": then})
        return bool(answer.get("succeeded", False))

    def _absent(self, key: str) -> dict[str, str]:
        return {"key": _encoded(self._prefix + key), "target": "CREATE", "result": "EQUAL", "create_revision": "0"}

    def _is(self, key: str, value: str) -> dict[str, str]:
        return {"key": _encoded(self._prefix + key), "target": "VALUE", "result": "EQUAL", "value": _encoded(value)}

    def _put(self, key: str, value: str, lease: str = "0") -> dict[str, Any]:
        return {"request_put": {"key": _encoded(self._prefix + key), "value": _encoded(value), "lease": lease}}

    async def _ask(self, what: str, body: Any, accept: Sequence[int] = (200,)) -> Any:
        return (await self._requests.ask("POST", f"/v3/{what}", body, accept=accept))[1]


def _encoded(text: str) -> str:
    return b64encode(text.encode()).decode()
