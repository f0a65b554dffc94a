"""Lease stores for tests: a real etcd, and a server that keeps the rules of Kubernetes' API for objects Lease.

No cluster runs here. The rules are those of the API's documentation: whoever changes an object names the resourceVersion that they
have read (409 otherwise), each change gives a new one, and what the type does not allow is refused (422).
"""

from __future__ import annotations

import shutil
import ssl
import subprocess
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import aiohttp
import pytest
from aiohttp import web
from waiting import until

from vistel.wire.certificates.authority import Authority
from vistel.wire.zenoh.config import TlsFiles
from vistel.wire.zenoh.endpoints import free_port


@contextmanager
def etcd(folder: Path, tls: TlsFiles | None = None) -> Iterator[str]:
    """An etcd of its own. Yields HOST:PORT. tls: it shows these certificates, and asks for one."""
    program = shutil.which("etcd") or pytest.skip("etcd is not on this machine (apt-get install etcd-server)")
    scheme, port = "http" if tls is None else "https", free_port()
    urls = [f"--{kind}-client-urls={scheme}://127.0.0.1:{port}" for kind in ("listen", "advertise")]
    peers = f"http://127.0.0.1:{free_port()}"
    urls += [f"--listen-peer-urls={peers}", f"--initial-advertise-peer-urls={peers}", f"--initial-cluster=default={peers}"]
    if tls is not None:
        urls += [f"--cert-file={tls.certificate}", f"--key-file={tls.key}", f"--trusted-ca-file={tls.ca}", "--client-cert-auth"]
    with (folder / "etcd.log").open("wb") as log:
        process = subprocess.Popen([program, f"--data-dir={folder / 'etcd'}", *urls], stdout=log, stderr=log)
        try:
            yield f"127.0.0.1:{port}"
        finally:
            process.kill()
            process.wait()


async def answers(address: str) -> None:
    """Wait until an etcd has begun."""
    ready: list[bool] = []
    async with aiohttp.ClientSession() as session:
        while not ready:
            try:
                async with session.post(f"http://{address}/v3/kv/range", json={"key": "YQ=="}) as answer:
                    ready += [True] if answer.status == 200 else []
            except aiohttp.ClientError:
                await until(lambda: True)


class KubernetesApi:
    """Objects Lease of one namespace. token: what a service account must show."""

    def __init__(self, token: str) -> None:
        self.token = token
        self.objects: dict[str, dict[str, Any]] = {}
        self.down = False
        self._version = 0

    async def handle(self, request: web.Request) -> web.Response:
        if self.down:
            return _status(503)
        if request.headers.get("Authorization") != f"Bearer {self.token}":
            return _status(401)
        name = request.match_info.get("name", "")
        if request.method == "GET":
            return web.json_response(self.objects[name]) if name in self.objects else _status(404)
        body = await request.json()
        name = name or body["metadata"]["name"]
        if (body["apiVersion"], body["kind"]) != ("coordination.k8s.io/v1", "Lease") or body["metadata"]["name"] != name:
            return _status(400)
        if not _allowed(body["spec"]):
            return _status(422)
        if request.method == "POST" and name in self.objects:
            return _status(409)
        if request.method == "PUT":
            if name not in self.objects:
                return _status(404)
            if body["metadata"]["resourceVersion"] != self.objects[name]["metadata"]["resourceVersion"]:
                return _status(409)
        self._version += 1
        body["metadata"] |= {"resourceVersion": str(self._version), "namespace": "meetings"}
        self.objects[name] = body
        return web.json_response(body, status=201 if request.method == "POST" else 200)


@asynccontextmanager
async def kubernetes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[tuple[KubernetesApi, Path]]:
    """The API over TLS, and a pod's folder with its account."""
    now = datetime.now(UTC)
    files = Authority.create(folder, now).issue("kubernetes", now, hosts=["127.0.0.1"])
    api = KubernetesApi("s3cret")
    (folder / "token").write_text(api.token + "\n")
    (folder / "namespace").write_text("meetings")
    shutil.copy(files.ca, folder / "ca.crt")
    tls = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    tls.load_cert_chain(files.certificate, files.key)
    app, path = web.Application(), "/apis/coordination.k8s.io/v1/namespaces/meetings/leases"
    app.add_routes([web.post(path, api.handle), web.get(path + "/{name}", api.handle), web.put(path + "/{name}", api.handle)])
    runner = web.AppRunner(app)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0, ssl_context=tls)
    await site.start()
    monkeypatch.setenv("KUBERNETES_SERVICE_HOST", "127.0.0.1")
    monkeypatch.setenv("KUBERNETES_SERVICE_PORT", str(runner.addresses[0][1]))
    try:
        yield api, folder
    finally:
        await runner.cleanup()


def _allowed(spec: dict[str, Any]) -> bool:
    try:
        for key in {"acquireTime", "renewTime"} & spec.keys():
            datetime.strptime(spec[key], "%Y-%m-%dT%H:%M:%S.%fZ")
    except ValueError:
        return False
    transitions = spec.get("leaseTransitions", 0)
    known = {"holderIdentity", "leaseDurationSeconds", "acquireTime", "renewTime", "leaseTransitions"}
    return spec.keys() <= known and spec.get("leaseDurationSeconds", 1) > 0 and 0 <= transitions < 2**31


def _status(code: int) -> web.Response:
    return web.json_response({"kind": "Status", "apiVersion": "v1", "status": "Failure", "code": code}, status=code)
