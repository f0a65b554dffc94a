"""A lease in Kubernetes: an object Lease of coordination.k8s.io/v1, changed only under the resourceVersion that was read.

The cluster's clocks are not believed: a lease has ended when it did not change here for as long as it lasts, as in client-go.
"""

from __future__ import annotations

import os
import secrets
import ssl
from collections.abc import Callable
from copy import deepcopy
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from vistel.wire.clock import Clock
from vistel.wire.lease.lease import Holder, LeaseStoreError
from vistel.wire.lease.requests import Requests

ACCOUNT = Path("/var/run/secrets/kubernetes.io/serviceaccount")
"""Where a pod finds its service account's token and namespace, which may change, and the certificate of the cluster's authority."""
LED = "vistel/led"
"""The annotation with term and place of who led last."""


class KubernetesLease:
    """See `Lease`. leaseTransitions is the term; renewTime is for people who look at it."""

    lasts_s = 15.0

    def __init__(self, conference: str, place: str, clock: Clock, account: Path = ACCOUNT) -> None:
        self._account, self._clock = account, clock
        self._requests: Requests | None = None
        self._object = "vistel-" + conference.replace("_", ".")  # no name of a conference has a dot
        self._place, self._name = place, f"{place}-{secrets.token_hex(8)}"
        self._known: dict[str, Any] = {}
        self._known_ns = 0

    async def holder(self) -> Holder:
        """As `Lease.holder`."""
        status, found = await self._ask("GET", f"/{self._object}", None, (200, 404))
        if status == 404:
            self._known = {}
            return Holder()
        if found["metadata"]["resourceVersion"] != self._known.get("metadata", {}).get("resourceVersion"):
            self._known, self._known_ns = found, self._clock.steady_ns()
        return self._holder(found)

    async def acquire(self, seen: Holder, term: int) -> bool:
        """As `Lease.acquire`: what `holder` read last is what must not have changed since."""
        if self._known and self._holder(self._known) != seen:
            return False

        def take(lease: dict[str, Any]) -> None:
            lease["spec"] |= {"leaseTransitions": term, "acquireTime": self._now(), **self._held()}

        return await self._change(take)

    async def renew(self) -> bool:
        """As `Lease.renew`."""
        return await self._change(lambda lease: lease["spec"].update(self._held()), mine=True)

    async def note_led(self) -> bool:
        """As `Lease.note_led`."""

        def note(lease: dict[str, Any]) -> None:
            led = f"{lease['spec']['leaseTransitions']} {self._place}"
            lease["metadata"].setdefault("annotations", {})[LED] = led
            lease["spec"] |= self._held()

        return await self._change(note, mine=True)

    async def release(self) -> None:
        """As `Lease.release`."""
        await self._change(lambda lease: lease["spec"].update(holderIdentity=""), mine=True)

    async def close(self) -> None:
        """As `Lease.close`."""
        if self._requests is not None:
            await self._requests.close()

    async def _change(self, change: Callable[[dict[str, Any]], None], mine: bool = False) -> bool:
        """Change what was read. False if it has changed meanwhile; mine: unless this world still holds it, then once more."""
        kind = {"apiVersion": "coordination.k8s.io/v1", "kind": "Lease", "metadata": {"name": self._object}, "spec": {}}
        for _ in range(2):
            if mine and self._known.get("spec", {}).get("holderIdentity") != self._name:
                return False
            lease = deepcopy(self._known or kind)
            change(lease)
            method, path = ("PUT", f"/{self._object}") if self._known else ("POST", "")
            status, answer = await self._ask(method, path, lease, (200, 201, 404, 409))
            if status in (200, 201):
                self._known, self._known_ns = answer, self._clock.steady_ns()
                return True
            await self.holder()
            if not mine:
                return False
        return False

    def _holder(self, lease: dict[str, Any]) -> Holder:
        spec, notes = lease["spec"], lease["metadata"].get("annotations", {})
        try:
            led_term, led_place = notes.get(LED, "-1 ").split(" ")
            lasts_ns = spec.get("leaseDurationSeconds", 0) * 1e9
            held = bool(spec.get("holderIdentity")) and self._clock.steady_ns() - self._known_ns < lasts_ns
            return Holder(int(spec.get("leaseTransitions", 0)), held, int(led_term), led_place)
        except (TypeError, ValueError) as e:
            raise LeaseStoreError(f"kubernetes: {self._object} holds no lease of a room; delete it") from e

    def _held(self) -> dict[str, Any]:
        return {"holderIdentity": self._name, "leaseDurationSeconds": round(self.lasts_s), "renewTime": self._now()}

    def _now(self) -> str:
        t_us = self._clock.now_ns() // 1000
        return (datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=t_us)).strftime("%Y-%m-%dT%H:%M:%S.%fZ")

    async def _ask(self, method: str, path: str, body: Any, accept: tuple[int, ...]) -> tuple[int, Any]:
        try:
            token, namespace = ((self._account / name).read_text("utf-8").strip() for name in ("token", "namespace"))
            if self._requests is None:
                host, port = os.environ["KUBERNETES_SERVICE_HOST"], os.environ["KUBERNETES_SERVICE_PORT"]
                tls = ssl.create_default_context(cafile=self._account / "ca.crt")
                self._requests = Requests([f"https://{f'[{host}]' if ':' in host else host}:{port}"], tls)
        except (KeyError, OSError) as e:
            raise LeaseStoreError(f"kubernetes: this is no pod of a cluster with a service account ({e})") from e
        url = f"/apis/coordination.k8s.io/v1/namespaces/{namespace}/leases{path}"
        return await self._requests.ask(method, url, body, {"Authorization": f"Bearer {token}"}, accept)
