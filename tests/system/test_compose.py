"""The commands of docker-compose.yml, run as plain processes over a real router port."""

from __future__ import annotations

import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from waiting import wait_until

from vistel.wire.log import LogReader

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]


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


def _free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def test_router_world_sites_and_recorder_meet_as_separate_commands(tmp_path: Path) -> None:
    port = _free_port()
    compose = yaml.safe_load((ROOT / "docker-compose.yml").read_text())
    text = (ROOT / "deploy/conference.toml").read_text().replace("tcp/router:7447", f"tcp/127.0.0.1:{port}")
    text = text.replace("/home/vistel/out", str(tmp_path / "out"))
    file = tmp_path / "conference.toml"
    file.write_text(text)
    # Kernels and people are made once; here it is the meeting that counts.
    subprocess.run([sys.executable, "-m", "vistel_cli.run.prepare", str(file)], check=True, stdout=subprocess.DEVNULL)
    processes: dict[str, subprocess.Popen[bytes]] = {}
    try:
        for name, service in compose["services"].items():
            command = " ".join(service["command"])
            for inside, here in (
                ("/etc/vistel/conference.toml", str(file)),
                ("tcp/0.0.0.0:7447", f"tcp/127.0.0.1:{port}"),
                ("/home/vistel/out", str(tmp_path / "out")),
            ):
                command = command.replace(inside, here)
            words = command.split()
            with (tmp_path / f"{name}.txt").open("wb") as output:
                processes[name] = subprocess.Popen([sys.executable, "-m", "vistel_cli.main", *words], stdout=output, stderr=output)
        videos = [tmp_path / "out" / s / f"{s}.mp4" for s in ("tokyo", "columbus")]

        def filmed() -> bool:
            assert all(p.poll() is None for p in processes.values()), {n: (tmp_path / f"{n}.txt").read_text() for n in processes}
            return all(v.exists() and v.stat().st_size > 30_000 for v in videos)

        wait_until(filmed, every_s=0.2)
    finally:
        codes: dict[str, int] = {}
        for name in ("tokyo", "columbus", "world", "recorder", "router"):
            if name in processes:
                processes[name].send_signal(signal.SIGTERM)
                try:
                    codes[name] = processes[name].wait(30)
                except subprocess.TimeoutExpired:
                    processes[name].kill()  # none may go on after a test, whatever went wrong
                    codes[name] = processes[name].wait()
    assert codes == dict.fromkeys(codes, 0)
    assert all(v.stat().st_size > 30_000 for v in videos)
    topics = {r.topic.name for r in LogReader(tmp_path / "out/recorder/conference.mcap").records()}
    assert {"motion", "world_state", "participant", "tracker", "glove", "heartbeat"} <= topics
