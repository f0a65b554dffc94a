"""`vistel doctor`: the equipment of this machine, and the substitute for each missing part."""

import multiprocessing
import os
import platform
import shutil
import socket
from collections.abc import Callable
from dataclasses import asdict
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from vistel.devices.kind import Finding, load
from vistel.devices.registry import kinds, packaged_kinds
from vistel_cli.conference_choice import Hub
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.terminal import FAILED, USAGE, fail, indented, out


def doctor(
    file: Annotated[Path | None, Takes(CONFERENCE), typer.Argument(help="Conference file, with --site.")] = None,
    site: Annotated[str | None, typer.Option(help="Measure the link of this site to its router instead, at the site.")] = None,
    hub: Hub = None,
    attack: Annotated[
        Path | None,
        Takes(CONFERENCE),
        typer.Option(help="Attack the running router of this conference file instead, on the host's machine; it harms no meeting."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """List the equipment of this machine, and the substitute for each missing part.

    [bold]Examples[/bold]

      vistel doctor

      vistel doctor conference.toml --site tokyo  # the link to the router

      vistel doctor --attack conference.toml  # what your router stops
    """
    if file is None and site is not None:
        fail("expected the conference file of the site before --site", USAGE)
    if file is not None:
        from vistel_cli.site.link_report import report as link_report

        raise typer.Exit(link_report(file, site, hub, as_json))
    if attack is not None:
        from vistel_cli.site.attack import report

        raise typer.Exit(report(attack, as_json))
    findings = [check() for check in CHECKS] + _devices() + [_disk()]
    if as_json:
        out.print_json(data=[asdict(f) for f in findings])
    else:
        colour = {"found": "green", "absent": "yellow", "broken": "red"}
        for f in findings:
            said = f"{f.detail} → {f.instead}" if f.instead else f.detail
            out.print(Text.assemble((f"{f.state:7}", colour[f.state]), f" {f.what:15} {indented(said, 24)}"), soft_wrap=True)
    if any(f.state == "broken" for f in findings):
        raise typer.Exit(FAILED)


def _python() -> Finding:
    return Finding("Python", "found", f"{platform.python_version()} on {platform.system()} {platform.machine()}")


def _machine() -> Finding:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    detail = f"{cores} cores"
    if hasattr(os, "sysconf"):
        detail += f", {os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2**30:.0f} GiB memory"
    return Finding("Processor", "found", detail)


def _probe_gl(connection: Connection) -> None:
    try:
        import moderngl  # the context belongs to a process of its own

        settings: dict[str, Any] = {"backend": "egl"} if platform.system() == "Linux" else {}
        context = moderngl.create_context(standalone=True, require=330, **settings)
        connection.send((context.info["GL_RENDERER"], context.version_code))
    except Exception as e:  # a driver may fail in any way; the probe's answer is that it did
        connection.send(str(e) or type(e).__name__)


def _gl() -> Finding:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_probe_gl, args=(theirs,))
    process.start()
    theirs.close()
    answer: tuple[str, int] | str = "no answer within 20 s"
    try:
        if ours.poll(20):
            answer = ours.recv()
    except EOFError:
        answer = "the driver ended the process"
    process.join(5)
    if process.is_alive():
        process.kill()
    if isinstance(answer, str):
        return Finding("OpenGL", "broken", answer.splitlines()[0], "apt-get install libegl1 libgl1 libgl1-mesa-dri")
    name, version = answer
    software = any(s in name.lower() for s in ("llvmpipe", "softpipe", "swiftshader"))
    text = f"{name}, {version // 100}.{version % 100 // 10}"
    if software:
        return Finding("GPU", "absent", text, "software drawing; figures deform on the CPU")
    return Finding("GPU", "found", text)


def _display() -> Finding:
    name = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    if name or platform.system() != "Linux":
        return Finding("Display", "found", name or "desktop")
    return Finding("Display", "absent", "neither DISPLAY nor WAYLAND_DISPLAY is set", "no windows; films and pages in browsers")


def _sound() -> Finding:
    cards = Path("/proc/asound/cards")
    if platform.system() == "Linux":
        text = cards.read_text() if cards.exists() else ""
        if not text or "no soundcards" in text:
            return Finding("Sound card", "absent", "none", "simulated talkers and sound files; the videos hold the sound")
        return Finding("Sound card", "found", text.split("]:")[-1].splitlines()[0].strip())
    return Finding("Sound card", "found", "by the system")


def router_port(port: int = 7447) -> Finding:
    """Whether a router on this machine could listen on `port`."""
    with socket.socket() as s:
        s.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as a router does: an earlier one's connections may last
        try:
            s.bind(("127.0.0.1", port))
        except OSError:
            return Finding(f"Port {port}", "absent", "in use, probably by a router", "`vistel up` takes a free port")
    return Finding(f"Port {port}", "found", "free for a router")


def _encoder() -> Finding:
    import av

    try:
        av.CodecContext.create("libx264", "w")
    except Exception as e:
        return Finding("H.264 encoder", "broken", str(e), "pip install av")
    return Finding("H.264 encoder", "found", f"libx264 in PyAV {av.__version__}")


def _devices() -> list[Finding]:
    """Findings on the requirements of each device kind, and the kinds from other packages."""
    found: list[Finding] = [load(check)() for check in dict.fromkeys(k.doctor for k in kinds() if k.doctor)]
    packaged, faults = packaged_kinds()
    if packaged:
        found.append(Finding("More devices", "found", ", ".join(f"{k.role} {k.name!r}: {k.title}" for k in packaged)))
    return found + [Finding("More devices", "broken", fault, "correct or remove that package") for fault in faults]


def _disk() -> Finding:
    free = shutil.disk_usage(Path.cwd()).free / 2**30
    if free < 1:
        return Finding("Disk", "broken", f"{free:.1f} GiB free here", "free at least 1 GiB")
    return Finding("Disk", "found", f"{free:.0f} GiB free here")


CHECKS: tuple[Callable[[], Finding], ...] = (_python, _machine, _gl, _display, _encoder, _sound, router_port)
