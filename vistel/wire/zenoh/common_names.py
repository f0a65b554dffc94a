"""Which certificates count. Zenoh's TLS reads no revocation list, so the common name says which: that of a site's first certificate
is the site's name, `tokyo`; once that is revoked, the next one's is `tokyo.2`. A router admits one common name for each site."""

from collections.abc import Collection, Iterable
from pathlib import Path

from vistel.whole_file import whole_file

AUTHORITY = "ca"
"""The name of the authority's files."""
REVOKED = "revoked.txt"
"""Beside the authority's certificate: common names that count no more, one a line."""


def revoked_names(folder: Path) -> list[str]:
    """Those in `folder`, in the order in which they were revoked."""
    path = folder / REVOKED
    return path.read_text("utf-8").split() if path.is_file() else []


def add_revoked(folder: Path, names: Iterable[str]) -> None:
    """Put further names on the list in `folder`. Raises OSError."""
    listed = [*revoked_names(folder), *names]
    with whole_file(folder / REVOKED, sync=True) as stream:
        stream.write("".join(f"{n}\n" for n in listed).encode())


def common_name(name: str, revoked: Collection[str]) -> str:
    """That of the certificates of `name` that count: the first which is not revoked."""
    number = 1
    while (found := name if number == 1 else f"{name}.{number}") in revoked:
        number += 1
    return found
