"""Configurations for `zenohd`, where a router is to run without Python.

`python -m vistel.wire.zenoh.deployment hub CONFERENCE SITE...` prints that of the hub, which knows who may say
what; `python -m vistel.wire.zenoh.deployment site HUB-ENDPOINT NAME` that of a router inside a site, which joins
the hub.
"""

import argparse
import sys
from pathlib import Path

from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.common_names import revoked_names
from vistel.wire.zenoh.config import Json, TlsFiles, as_text, router_config

CERTIFICATES = Path("/etc/vistel/certificates")


def hub_config(conference: str, sites: list[str], folder: Path = CERTIFICATES) -> Json:
    """The hub: QUIC and TLS on port 7447 for the sites, by their certificates."""
    rules = access_rules(conference, sites, revoked=revoked_names(folder))
    return router_config(["quic/0.0.0.0:7447", "tls/0.0.0.0:7447"], _files(folder, "hub"), rules)


def site_config(hub: str, site: str, folder: Path = CERTIFICATES) -> Json:
    """A site's own router: plain TCP on its loopback interface only, TLS with the site's certificate to the hub."""
    config = router_config(["tcp/127.0.0.1:7447"], _files(folder, site), connect=[hub])
    link = config["transport"]["link"]
    link["protocols"] = ["tcp", "tls", "quic"]
    for name in ("listen_certificate", "listen_private_key"):
        del link["tls"][name]
    return config


def _files(folder: Path, name: str) -> TlsFiles:
    return TlsFiles(folder / "ca.pem", folder / f"{name}.pem", folder / f"{name}.key")


def main(arguments: list[str]) -> str:
    """The configuration asked for, as text."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--certificates", type=Path, default=CERTIFICATES, help="folder on the router's machine")
    kinds = parser.add_subparsers(dest="kind", required=True)
    hub = kinds.add_parser("hub")
    hub.add_argument("conference")
    hub.add_argument("sites", nargs="+")
    site = kinds.add_parser("site")
    site.add_argument("hub", help="e.g. tls/hub.example.org:7447")
    site.add_argument("name", help="the site's name; its certificate is NAME.pem")
    given = parser.parse_args(arguments)
    if given.kind == "hub":
        return as_text(hub_config(given.conference, given.sites, given.certificates))
    return as_text(site_config(given.hub, given.name, given.certificates))


if __name__ == "__main__":
    print(main(sys.argv[1:]), end="")
