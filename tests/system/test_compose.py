"""The commands of docker-compose.yml, run as plain processes over a real router port with the certificates that they make."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest
import yaml
from waiting import wait_until

from vistel.wire.log import LogReader
from vistel.wire.zenoh.endpoints import free_port

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
SERVICES: dict[str, dict[str, Any]] = yaml.safe_load((ROOT / "docker-compose.yml").read_text())["services"]


def _compose_command() -> list[str] | None:
    if shutil.which("docker-compose"):
        return ["docker-compose"]
    if shutil.which("docker"):
        known = subprocess.run(["docker", "compose", "version"], capture_output=True, check=False)
        return ["docker", "compose"] if known.returncode == 0 else None
    return None


def test_docker_compose_accepts_the_file() -> None:
    command = _compose_command()
    if command is None:
        pytest.skip("docker compose is not on this machine")
    done = subprocess.run(
        [*command, "-f", str(ROOT / "docker-compose.yml"), "config", "-q"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


class Containers:
    """Each service with a folder of its own in place of /etc/vistel; volumes are folders."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.router = folder, free_port()
        self.ports = {name: free_port() for name in SERVICES}

    def here(self, name: str, text: str) -> str:
        """What a text of a service means here."""
        for inside, outside in {
            "/etc/vistel": self.folder / name,
            "/sites": self.folder / "volumes",
            "/home/vistel": self.folder,
            "tls/0.0.0.0:7447": f"tls/127.0.0.1:{self.router}",
            "tls/router:7447": f"tls/127.0.0.1:{self.router}",
            "0.0.0.0:9464": f"127.0.0.1:{self.ports[name]}",
            "$$": "$",
        }.items():
            text = text.replace(inside, str(outside))
        return text

    def prepare(self, name: str) -> None:
        """The conference file and volumes of a service."""
        (self.folder / name).mkdir()
        (self.folder / name / "conference.toml").write_text(self.here(name, (ROOT / "deploy/conference.toml").read_text()))
        for volume in SERVICES[name]["volumes"]:
            source, _, target = volume.partition(":")
            if not source.startswith("."):
                (self.folder / "volumes" / source).mkdir(parents=True, exist_ok=True)
            if target.removesuffix(":ro") == "/etc/vistel/certificates":
                (self.folder / name / "certificates").symlink_to(self.folder / "volumes" / source)

    def start(self, name: str) -> subprocess.Popen[bytes]:
        service = SERVICES[name]
        words = [self.here(name, word) for word in service["command"]]
        command = [*service["entrypoint"], *words] if "entrypoint" in service else [sys.executable, "-m", "vistel_cli.main", *words]
        path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
        with (self.folder / f"{name}.txt").open("wb") as output:
            return subprocess.Popen(command, stdout=output, stderr=output, env=os.environ | {"PATH": path})

    def said_by(self, *names: str) -> str:
        """All that services and their processes have said."""
        logs = [
            log for name in names for log in (self.folder / f"{name}.txt", *(self.folder / "out" / name / "logs").glob("*.log"))
        ]
        return "\n".join(f"{log}:\n{log.read_text(errors='replace')}" for log in logs)

    def asked(self, name: str, path: str) -> str:
        """What a container answers at its address; empty while it does not."""
        with suppress(OSError), urlopen(f"http://127.0.0.1:{self.ports[name]}{path}", timeout=10) as answer:
            return answer.read().decode()
        return ""


def test_router_world_sites_and_recorder_meet_as_separate_commands_with_certificates_of_their_own(tmp_path: Path) -> None:
    containers = Containers(tmp_path)
    for name in SERVICES:
        containers.prepare(name)
    assert containers.start("certificates").wait() == 0, (tmp_path / "certificates.txt").read_text()
    assert not list((tmp_path / "tokyo/certificates/").glob("ca.key")), "the authority's key stays with it"
    # Kernels and people are made once; here it is the meeting that counts.
    file = tmp_path / "world/conference.toml"
    subprocess.run([sys.executable, "-m", "vistel_cli.run.prepare", str(file)], check=True, stdout=subprocess.DEVNULL)
    processes: dict[str, subprocess.Popen[bytes]] = {}

    def alive() -> None:
        assert all(p.poll() is None for p in processes.values()), containers.said_by(*processes)

    def ready(*names: str) -> bool:
        alive()
        return all(containers.asked(name, "/readyz") for name in names if "healthcheck" not in SERVICES[name])

    videos = [tmp_path / "out" / s / f"{s}.mp4" for s in ("tokyo", "columbus")]

    def filmed() -> bool:
        alive()
        return all(v.exists() and v.stat().st_size > 30_000 for v in videos)

    try:
        processes["router"] = containers.start("router")
        wait_until(lambda: ready("router"), every_s=0.2)
        processes |= {name: containers.start(name) for name in SERVICES if name not in ("certificates", "router")}
        wait_until(lambda: ready(*processes), every_s=0.2)
        wait_until(filmed, every_s=0.2)
        shown = (
            ("world", 'vistel_world_lease_held_count{process="world",site="hub"} 1.0'),
            ("tokyo", 'vistel_renderer_rate_hertz{process="renderer",site="tokyo"}'),
        )
        for name, figure in shown:
            wait_until(lambda name=name, figure=figure: figure in containers.asked(name, "/metrics"), every_s=0.2)
    finally:
        codes: dict[str, int] = {}
        for name in ("tokyo", "columbus", "world", "recorder", "authority", "router"):
            if name in processes:
                processes[name].send_signal(signal.SIGTERM)
                try:
                    codes[name] = processes[name].wait(150)  # as the file gives them
                except subprocess.TimeoutExpired:
                    processes[name].kill()  # none may go on after a test, whatever went wrong
                    codes[name] = processes[name].wait()
    assert codes == dict.fromkeys(codes, 0), containers.said_by(*(name for name, code in codes.items() if code))
    assert list((tmp_path / "room").glob("*.snapshot"))
    topics = {r.topic.name for r in LogReader(tmp_path / "out/recorder/conference.mcap").records()}
    assert {"motion", "world_state", "participant", "tracker", "glove", "heartbeat"} <= topics
