"""`vistel site invite`: gives sites their certificates and the conference file; `vistel site join --invite` takes them."""

from __future__ import annotations

import asyncio
import contextlib
import sys
import tomllib
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Annotated, Any

import typer

from vistel.conference.files import text_without_tokens
from vistel.conference.model import RESERVED
from vistel.whole_file import whole_file
from vistel.wire.zenoh.endpoints import host_and_port, is_local
from vistel_cli.overwriting import keep_existing
from vistel_cli.site.certificate_folder import authority_of, check_name
from vistel_cli.site.certs import DAYS, Days, File
from vistel_cli.stop_asked import stop_asked
from vistel_cli.terminal import FAILED, USAGE, err, fail, load_conference, out

PORT = 7448
"""Beside the router's."""


def invite(
    file: File,
    sites: Annotated[list[str], typer.Argument(help="Who is invited: sites or observers of the file.")],
    hours: Annotated[float, typer.Option(min=0.01, max=720, help="How long the invitations are valid.")] = 24.0,
    days: Days = DAYS,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port that the others reach; 0 takes a free one.")] = PORT,
) -> None:
    """Invite sites: print one line for each, to be pasted into `vistel site join --invite -` there, and wait until they have come.

    Send each line by a way that only its reader sees. It is valid once, for one site, and while this command runs. The conference
    file goes with it, without the tokens of other sites' pages and of the console. The authority's key is needed here
    (`vistel site certs init`).

    [bold]Example[/bold]

      vistel site invite conference.toml tokyo
    """
    conference = load_conference(file)
    authority = authority_of(conference)
    for site in sites:
        check_name(conference, site)
        if site in RESERVED:
            fail(f"{site}: may do more than a site, and is not invited; vistel site certs add makes its files here", USAGE)
    text = file.read_text("utf-8")
    if not _folder_name(text):
        fail(f"{file}: tls.folder: expected a name without a path, as the invited get the folder beside the conference file")
    from vistel.wire.certificates.enrolment import Enrolment

    endpoint = conference.bus.endpoints[0] if conference.bus.endpoints else ""
    if not endpoint:
        fail(f"{file}: bus.endpoints: expected the address at which others find this machine, such as tls/192.0.2.7:7447")

    def file_of(site: str) -> str:
        return text_without_tokens(tomllib.loads(text), but_of=site)

    enrolment = Enrolment(authority, conference.name, file_of, lambda: datetime.now(UTC), valid=timedelta(days=days))
    asyncio.run(_invite(enrolment, sites, endpoint, port, hours))


async def _invite(enrolment: Any, sites: list[str], endpoint: str, port: int, hours: float) -> None:
    done = stop_asked()

    def enrolled(site: str, address: str) -> None:
        out.print(f"{site}: has its certificate, at {address}")
        if not enrolment.waiting:
            asyncio.get_running_loop().call_later(0.5, done.set)  # after the answer has left

    enrolment.on_enrolled = enrolled
    try:
        server = await enrolment.listen("127.0.0.1" if is_local(endpoint) else "0.0.0.0", port)
    except OSError as e:
        fail(f"--port {port}: cannot listen: {e.strerror or e}")
    host = host_and_port(endpoint)[0]
    here = server.sockets[0].getsockname()[1]
    for site in sites:
        code = enrolment.invite(site, host, here, timedelta(hours=hours)).code
        out.print(
            f"{site}: type `vistel site join --invite -` there, within {hours:g} hours, and paste this line:\n", soft_wrap=True
        )
        out.print(f"    {code}\n", soft_wrap=True)
    out.print("waiting; Ctrl-C takes the invitations back")
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(hours * 3600):
            await done.wait()
    server.close()
    if left := enrolment.waiting:
        out.print(f"taken back: {', '.join(left)}")


def accept(code: str, *, force: bool) -> tuple[Path, str]:
    """Gets the certificate of an invitation, and stores it with the conference file in a folder with the conference's name. Returns
    the file and the site. Ends the command where it is refused. code: "-" reads it, so that no list of processes shows it."""
    from vistel.wire.certificates.authority import write_key
    from vistel.wire.certificates.enrolment import enrol
    from vistel.wire.certificates.invitation import Invitation, InvitationError

    if code == "-":
        if sys.stdin.isatty():
            err.print("the line of the invitation: ", end="")
        code = sys.stdin.readline()
    try:
        invitation = Invitation.read(code)
        folder, site = Path(invitation.conference), invitation.site
        keep_existing(folder / "conference.toml", force=force)
        enrolled = enrol(invitation)
    except InvitationError as e:
        fail(f"--invite: {e}", FAILED)
    name = _folder_name(enrolled.conference)
    if not name:
        fail("--invite: the conference file that came names no folder of certificates beside it; ask the host")
    certificates = folder / name
    try:
        certificates.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_key(certificates / f"{site}.key", enrolled.key)
        for path, content in (
            (certificates / f"{site}.pem", enrolled.certificate),
            (certificates / "ca.pem", enrolled.authority),
            (folder / "conference.toml", enrolled.conference.encode()),
        ):
            with whole_file(path) as stream:
                stream.write(content)
    except OSError as e:
        fail(f"{e.filename or folder}: cannot be written: {e.strerror or e}")
    file = folder / "conference.toml"
    out.print(f"{folder}: conference file and certificates; from now on: vistel site join {file} {site}", soft_wrap=True)
    return file, site


def _folder_name(conference: str) -> str:
    """The folder of certificates that the text of a conference file names beside it; empty: none."""
    try:
        name = tomllib.loads(conference)["bus"]["tls"]["folder"]
    except (ValueError, KeyError, TypeError):
        return ""
    return name if isinstance(name, str) and Path(name).name == name and name not in ("", ".", "..") and "\0" not in name else ""
