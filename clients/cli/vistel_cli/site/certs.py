"""`vistel site certs`: the certificates of a conference across machines."""

from __future__ import annotations

import asyncio
import base64
import json
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from vistel.conference.model import HUB_PLACE, Conference
from vistel.wire.zenoh.access import ROUTER_NAME
from vistel_cli.conference_choice import Hub, endpoint_of
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.overwriting import Force, keep_existing
from vistel_cli.site.certificate_folder import authority_of, check_name, folder_of, hosts_of
from vistel_cli.terminal import USAGE, fail, load_conference, out

if TYPE_CHECKING:
    from vistel.wire.certificates.authority import Authority, Issued
    from vistel.wire.zenoh.config import TlsFiles

app = typer.Typer(no_args_is_help=True)
File = Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file with a folder of certificates under \\[bus.tls].")]
Days = Annotated[int, typer.Option(min=1, max=825, help="How many days the certificates are valid.")]
DAYS = 90


@app.command()
def init(file: File, days: Days = DAYS, force: Force = False) -> None:
    """Make the authority that signs a conference's certificates, and the certificate of the hub.

    The hub's certificate is valid for the addresses that the file names under \\[bus]. Keep the folder on the hub's machine.

    [bold]Example[/bold]

      vistel site certs init conference.toml
    """
    from vistel.wire.certificates.authority import Authority

    conference = load_conference(file)
    folder = folder_of(conference)
    there = next((f for f in ("ca.key", "ca.pem", "hub.key", "hub.pem") if (folder / f).exists()), None)
    if there is not None and not force:
        again = f"`vistel site certs renew {file}` renews certificates; --force begins anew, and those that were given away end"
        fail(f"{folder / there}: an authority has been made here; {again}")
    try:
        authority = Authority.create(folder, datetime.now(UTC))
        authority.issue(HUB_PLACE, datetime.now(UTC), hosts=hosts_of(conference), valid=timedelta(days=days))
    except OSError as e:
        fail(f"{folder}: cannot be written: {e.strerror or e}")
    out.print(f"{folder}: authority, and certificate of the hub at {', '.join(hosts_of(conference))}", soft_wrap=True)


@app.command()
def add(
    file: File,
    names: Annotated[list[str], typer.Argument(help="Sites or observers of the file, world, or router: a second one.")],
    days: Days = DAYS,
    force: Force = False,
) -> None:
    """Make keys and certificates here, for machines to which you then carry the files.

    If the other machine can reach this one, use `vistel site invite` instead: then no key leaves its machine.

    [bold]Example[/bold]

      vistel site certs add conference.toml tokyo columbus
    """
    conference = load_conference(file)
    authority = authority_of(conference)
    for name in names:
        check_name(conference, name)
    keep_existing(*(authority.folder / f"{n}.key" for n in names), force=force)
    for name in names:
        files = _issued(conference, authority, name, days)
        out.print(
            f"{name}: give it {files.ca.name}, {files.certificate.name} and {files.key.name} of {authority.folder}", soft_wrap=True
        )


@app.command()
def renew(
    file: File,
    names: Annotated[list[str] | None, typer.Argument(help="Sites; default: all whose keys are here.")] = None,
    days: Days = DAYS,
    hub: Hub = None,
) -> None:
    """Make new keys and certificates in place of those that expire soon. A router that runs takes up its own at once.

    A running process renews its own by itself, in the last third of its lifetime. If the authority's key is not here, the host
    signs the new one, and decides how many days it is valid.

    [bold]Example[/bold]

      vistel site certs renew conference.toml
    """
    conference = load_conference(file)
    if not (folder_of(conference) / "ca.key").exists():
        _ask_to_renew(conference, names, hub)
        return
    authority = authority_of(conference)
    here = {i.name: i for i in authority.issued() if i.key_here and i.name != "ca"}
    for name in names or here:
        check_name(conference, name)
        if name not in here:
            fail(f"{name}: its key is not in {authority.folder}; a new invitation renews it: vistel site invite {file} {name}")
        if here[name].revoked:
            fail(f"{name}: is revoked; let it in again with vistel site certs add --force, or with an invitation")
        _issued(conference, authority, name, days)
        out.print(f"{name}: good for {days} days")


def _ask_to_renew(conference: Conference, names: list[str] | None, hub: str | None) -> None:
    from vistel.wire.certificates.authority import files_of
    from vistel.wire.certificates.errors import CertificateError
    from vistel.wire.certificates.renewal import renew
    from vistel_cli.renewing import asking_at, now

    folder = folder_of(conference)
    for name in names or sorted(key.stem for key in folder.glob("*.key")):
        check_name(conference, name)
        files = files_of(folder, name)
        try:
            until = asyncio.run(renew(files, asking_at(conference, name, endpoint_of(conference, hub), files), now, early=True))
        except (CertificateError, OSError) as e:
            fail(str(e))
        out.print(f"{name}: good until {until:%Y-%m-%d}" if until else f"{name}: another process renews it now")


@app.command()
def serve(
    file: File, hub: Hub = None, seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0
) -> None:
    """Sign for sites that renew their certificates, and tell routers which were revoked, while this runs.

    For conferences whose router runs on a machine without the key of the authority; where it has the key, `vistel site router` does
    the same. Sites ask in the last third of a certificate's lifetime: 30 days of 90.

    [bold]Example[/bold]

      vistel site certs serve conference.toml
    """
    from vistel_cli.site.router import run_signing

    conference = load_conference(file)
    authority_of(conference)
    raise typer.Exit(run_signing(conference, endpoint_of(conference, hub), seconds))


@app.command()
def revoke(file: File, name: Annotated[str, typer.Argument(help="Sites whose certificates become invalid.")]) -> None:
    """Make the present certificates of a site invalid. A router that runs applies this within two seconds.

    A new certificate, from `add` or an invitation, lets the site in again.

    [bold]Example[/bold]

      vistel site certs revoke conference.toml tokyo
    """
    conference = load_conference(file)
    authority = authority_of(conference)
    issued = _issued_to(authority, name)
    if issued is None or name == "ca":
        fail(f"{name}: has no certificate in {authority.folder}", USAGE)
    if issued.revoked:
        fail(f"{name}: its certificate is revoked already")
    try:
        gone = authority.revoke(name)
    except OSError as e:
        fail(f"{authority.folder}: cannot be written: {e.strerror or e}")
    out.print(f"{name}: certificates with the common name {gone} count no more")
    if name == HUB_PLACE:
        _issued(conference, authority, name, DAYS)
        out.print(f"{name}: has a new certificate; give it to every machine on which something of the hub runs")


@app.command()
def show(file: File, as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False) -> None:
    """List the certificates that were signed: whose, until when, where the key is.

    [bold]Example[/bold]

      vistel site certs show conference.toml
    """
    now = datetime.now(UTC)
    rows = [
        {
            "name": "authority" if i.name == "ca" else i.name,
            "state": i.state(now),
            "until": f"{i.until:%Y-%m-%d}",
            "days": (i.until - now).days,
            "key_here": i.key_here,
            "common_name": i.common_name,
            "serial": f"{i.serial:x}",
        }
        for i in authority_of(load_conference(file)).issued()
    ]
    if as_json:
        print(json.dumps({"certificates": rows}))
        return
    table = Table("of", "", "until", "key", "common name", box=None)
    for r in rows:
        key = "here" if r["key_here"] else "there"
        table.add_row(r["name"], r["state"], f"{r['until']} ({r['days']} days)", key, r["common_name"])
    out.print(table)


@app.command()
def secret(
    file: File,
    name: Annotated[str, typer.Argument(help="Whose certificate and key.")] = HUB_PLACE,
    namespace: Annotated[str, typer.Option(help="Namespace in the cluster.")] = "vistel",
    called: Annotated[str, typer.Option(help="Name of the Secret.")] = "vistel-certificates",
) -> None:
    """Print a certificate with its key as a Secret of Kubernetes, for a pipe to kubectl. The key of the authority is not in it.

    [bold]Example[/bold]

      vistel site certs secret conference.toml | kubectl apply --filename -
    """
    from vistel.wire.certificates.authority import files_of

    conference = load_conference(file)
    check_name(conference, name)
    if sys.stdout.isatty():
        fail("what is printed has a private key in it: pipe it to kubectl apply --filename -", USAGE)
    files = files_of(folder_of(conference), name)
    data = dict[str, str]()
    for path in (files.ca, files.certificate, files.key):
        try:
            data[path.name] = base64.b64encode(path.read_bytes()).decode()
        except OSError as e:
            fail(f"{path}: cannot be read: {e.strerror or e}; vistel site certs init and add make it")
    about = {"name": called, "namespace": namespace}
    print(json.dumps({"apiVersion": "v1", "kind": "Secret", "metadata": about, "type": "Opaque", "data": data}, indent=2))


def _issued(conference: Conference, authority: Authority, name: str, days: int) -> TlsFiles:
    hosts = hosts_of(conference) if name in (HUB_PLACE, ROUTER_NAME) else ()
    try:
        return authority.issue(name, datetime.now(UTC), hosts=hosts, valid=timedelta(days=days))
    except OSError as e:
        fail(f"{authority.folder}: cannot be written: {e.strerror or e}")


def _issued_to(authority: Authority, name: str) -> Issued | None:
    return next((i for i in authority.issued() if i.name == name), None)
