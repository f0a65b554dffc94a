"""Image, containers, cluster and units: every command is one that the program knows, every file is what its format allows, and
nothing runs with more rights than it needs."""

from __future__ import annotations

import base64
import json
import re
import shlex
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml
from typer.core import TyperGroup
from typer.testing import CliRunner

from vistel.conference.files import load
from vistel_cli.main import app

ROOT = Path(__file__).resolve().parents[3]
DEPLOY = ROOT / "deploy"
COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / "docker-compose.yml").read_text("utf-8"))
UNITS = sorted(DEPLOY.glob("systemd/*.service"))
CLUSTER = [
    (file.name, d)
    for file in sorted(DEPLOY.glob("kubernetes/*.yaml"))
    if file.name != "kustomization.yaml"
    for d in yaml.safe_load_all(file.read_text("utf-8"))
]
PODS = {d["metadata"]["name"]: d["spec"]["template"]["spec"] for _, d in CLUSTER if d["kind"] in ("Deployment", "StatefulSet")}
MONITORED = "0.0.0.0:9464"


def commands() -> Iterator[tuple[str, list[str]]]:
    for name, service in COMPOSE["services"].items():
        if "entrypoint" in service:
            for line in re.findall(r"^\s*vistel (.*)$", service["command"][0], re.MULTILINE):
                yield f"compose-{name}", shlex.split(line)
        else:
            yield f"compose-{name}", service["command"]
    for name, pod in PODS.items():
        yield f"kubernetes-{name}", [word.replace("$(POD)", "world-0") for word in pod["containers"][0]["args"]]
    for unit in UNITS:
        for line in re.findall(r"^ExecStart=(.*)$", unit.read_text("utf-8"), re.MULTILINE):
            words = shlex.split(line.replace("%i", "tokyo"))
            assert words[0] == "/opt/vistel/.venv/bin/vistel"
            yield unit.name, words[1:]
    for words in re.findall(r'^(?:ENTRYPOINT|CMD) \["vistel"\]\nCMD \["(\w+)"\]', (DEPLOY / "Dockerfile").read_text("utf-8"), re.M):
        yield "image", [words]


@pytest.mark.parametrize(("where", "words"), list(commands()))
def test_a_command_is_one_that_the_program_knows(where: str, words: list[str]) -> None:
    command: Any = typer.main.get_command(app)
    while True:
        context = command.make_context(command.name or "vistel", list(words), resilient_parsing=False)
        if not isinstance(command, TyperGroup):
            break
        _, command, words = command.resolve_command(context, [*context._protected_args, *context.args])
    assert context.params, where


@pytest.mark.parametrize("folder", ["", "kubernetes"])
def test_the_conference_files_are_encrypted_and_monitored_where_probes_look(folder: str) -> None:
    conference = load(DEPLOY / folder / "conference.toml")
    assert conference.bus.tls is not None and not conference.bus.insecure
    assert all(e.startswith("tls/") for e in conference.bus.endpoints)
    assert conference.monitoring.listen == conference.monitoring.router == MONITORED
    assert "127.0.0.1:9464/readyz" in (DEPLOY / "Dockerfile").read_text("utf-8")


# -- image and containers --------------------------------------------------------------------------------------


def test_the_image_has_no_tools_of_developers_and_runs_as_nobody_special() -> None:
    lines = (DEPLOY / "Dockerfile").read_text("utf-8").splitlines()
    assert [line for line in lines if line.startswith("FROM")] == ["FROM ${BASE} AS build", "FROM ${BASE}"]
    last = lines[lines.index("FROM ${BASE}") :]
    assert next(line for line in last if line.startswith("USER")) == "USER 10001"
    assert any(line.startswith("HEALTHCHECK") for line in last)
    pins = {
        name: re.findall(r"^([\w.\-]+)==(\S+)", (folder / "requirements.lock").read_text("utf-8"), re.MULTILINE)
        for name, folder in {"all": ROOT, "image": DEPLOY}.items()
    }
    assert set(pins["image"]) < set(pins["all"]), "write both anew: make lock"
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    tools = {re.match(r"[\w\-]+", r)[0] for r in extras["dev"]} - {"vistel", "pyyaml", "setuptools"}  # type: ignore[index]
    assert not tools & dict(pins["image"]).keys()


def test_what_the_image_copies_is_there_and_not_ignored() -> None:
    copied = re.findall(r"^COPY (?!--from)(.+) \S+$", (DEPLOY / "Dockerfile").read_text("utf-8"), re.MULTILINE)
    ignored = (ROOT / ".dockerignore").read_text("utf-8").splitlines()
    assert "*" in ignored
    for path in " ".join(copied).split():
        assert (ROOT / path).exists() and f"!{path}" in ignored


@pytest.mark.parametrize("name", COMPOSE["services"])
def test_a_container_has_no_rights_to_write_but_in_its_volumes(name: str) -> None:
    service = COMPOSE["services"][name]
    assert service.keys() <= {
        *("image", "build", "restart", "init", "read_only", "tmpfs", "cap_drop", "security_opt", "networks", "logging"),
        *("command", "entrypoint", "depends_on", "ports", "volumes", "healthcheck", "stop_grace_period"),
    }
    assert service["read_only"] is True and service["cap_drop"] == ["ALL"] and "no-new-privileges:true" in service["security_opt"]
    assert service["logging"]["options"].keys() == {"max-size", "max-file"}
    sources = [v.partition(":")[0] for v in service["volumes"]]
    assert all((ROOT / s).exists() if s.startswith(".") else s in COMPOSE["volumes"] for s in sources)
    assert "authority" not in sources or name in ("certificates", "authority"), "nobody else sees the key of the authority"
    assert all(port.startswith("127.0.0.1:") and port.endswith(":9464") for port in service.get("ports", []))
    assert set(service.get("depends_on", {})) <= COMPOSE["services"].keys()


# -- cluster ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("file", "document"), CLUSTER, ids=[f"{f}-{d['kind']}" for f, d in CLUSTER])
def test_an_object_of_the_cluster_is_what_its_schema_allows(file: str, document: dict[str, Any]) -> None:
    kubernetes_validate = pytest.importorskip("kubernetes_validate", reason="kubernetes_validate is not installed")
    kubernetes_validate.validate(document, "1.32", strict=True)


def test_kustomize_builds_all_of_it() -> None:
    listed = yaml.safe_load((DEPLOY / "kubernetes/kustomization.yaml").read_text("utf-8"))
    assert sorted(listed["resources"]) == sorted({file for file, _ in CLUSTER})
    if shutil.which("kubectl") is None:
        pytest.skip("kubectl is not on this machine")
    done = subprocess.run(["kubectl", "kustomize", str(DEPLOY / "kubernetes")], capture_output=True, text=True, check=True)
    built = [d for d in yaml.safe_load_all(done.stdout) if d["kind"] != "ConfigMap"]
    assert len(built) == len(CLUSTER)
    assert all(d["metadata"].get("namespace") == "vistel" for d in built if d["kind"] != "Namespace")


@pytest.mark.parametrize("name", PODS)
def test_a_pod_is_probed_and_has_no_rights_to_spare(name: str) -> None:
    pod = PODS[name]
    (container,) = pod["containers"]
    assert pod["securityContext"]["runAsNonRoot"] and pod["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}
    assert container["securityContext"] == {
        "allowPrivilegeEscalation": False,
        "readOnlyRootFilesystem": True,
        "capabilities": {"drop": ["ALL"]},
    }
    assert {"name": "metrics", "containerPort": 9464} in container["ports"]
    paths = {probe: container[f"{probe}Probe"]["httpGet"]["path"] for probe in ("startup", "liveness", "readiness")}
    assert paths == {"startup": "/healthz", "liveness": "/healthz", "readiness": "/readyz"}
    assert {"cpu", "memory"} <= container["resources"]["requests"].keys() and "memory" in container["resources"]["limits"]
    assert (pod.get("serviceAccountName") == "world") != (pod.get("automountServiceAccountToken") is False)
    projected = pod["volumes"][0]["projected"]["sources"]
    assert {i["key"] for s in projected for i in s.get("secret", {}).get("items", [])} == {"ca.pem", "hub.pem", "hub.key"}


def test_worlds_may_use_their_lease_and_no_other() -> None:
    conference = load(DEPLOY / "kubernetes/conference.toml")
    (role,) = (d for _, d in CLUSTER if d["kind"] == "Role")
    assert conference.world.lease == "kubernetes"
    assert [(r["resources"], r.get("resourceNames"), r["verbs"]) for r in role["rules"]] == [
        (["leases"], None, ["create"]),
        (["leases"], [f"vistel-{conference.name}"], ["get", "update"]),
    ]


# -- units -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", UNITS, ids=lambda u: u.name)
def test_systemd_accepts_a_unit(unit: Path, tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd-analyze is not on this machine")
    there = tmp_path / unit.name
    there.write_text(unit.read_text("utf-8").replace("/opt/vistel/.venv/bin/vistel", "/bin/true"))
    done = subprocess.run(["systemd-analyze", "verify", "--man=no", str(there)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("unit", UNITS, ids=lambda u: u.name)
def test_a_unit_starts_again_and_writes_in_its_own_folders_only(unit: Path) -> None:
    text = unit.read_text("utf-8")
    for line in ("User=vistel", "Restart=always", "NoNewPrivileges=true", "ProtectSystem=strict", "ProtectHome=true"):
        assert f"\n{line}\n" in text
    written = re.findall(r"(?:--out |CACHE_HOME=|CACHE_DIR=|RUNTIME_DIR=)(\S+)", text)
    assert all(w.startswith(("/var/lib/vistel", "/var/cache/vistel", "/run/vistel-")) for w in written)


def test_the_secret_that_a_command_prints_is_the_one_which_the_pods_mount_and_has_no_key_of_the_authority(tmp_path: Path) -> None:
    kubernetes_validate = pytest.importorskip("kubernetes_validate", reason="kubernetes_validate is not installed")
    file = tmp_path / "conference.toml"
    file.write_text((DEPLOY / "kubernetes/conference.toml").read_text("utf-8"))
    (folder := tmp_path / "certificates").mkdir(mode=0o700)
    assert CliRunner().invoke(app, ["site", "certs", "secret", str(file)]).exit_code == 1, "nothing is there yet"
    assert CliRunner().invoke(app, ["site", "certs", "init", str(file)]).exit_code == 0
    again = CliRunner().invoke(app, ["site", "certs", "init", str(file)])
    assert again.exit_code == 1 and "ca.key: an authority has been made here; `vistel site certs renew" in again.stderr
    printed = CliRunner().invoke(app, ["site", "certs", "secret", str(file)])
    document = json.loads(printed.stdout)
    kubernetes_validate.validate(document, "1.32", strict=True)
    for pod in PODS.values():
        (mounted,) = [s["secret"] for v in pod["volumes"] for s in v.get("projected", {}).get("sources", []) if "secret" in s]
        assert mounted["name"] == document["metadata"]["name"]
        assert {item["key"] for item in mounted["items"]} <= document["data"].keys()
    assert {k: base64.b64decode(v) for k, v in document["data"].items()} == {
        n: (folder / n).read_bytes() for n in ("ca.pem", "hub.pem", "hub.key")
    }
