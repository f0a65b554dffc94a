"""Pages that were shown on panels, as a log has them."""

import logging
from collections import OrderedDict
from collections.abc import Iterator, Mapping

from vistel.space.files.model import Polymesh
from vistel.space.pages.sheet import MOST_BYTES, PageError, sheet_of, unpacked_page
from vistel.wire.log import LogRecord
from vistel.wire.parcels import Parcels

log = logging.getLogger("vistel.renderer")

DECODED = 6
"""Pages that are kept as pictures; the others are decoded again when they are shown again."""


class RecordedPages(Mapping[str, Polymesh]):
    """Polymeshes by digest: those of a room, and pages as their records come."""

    def __init__(self, others: Mapping[str, Polymesh]) -> None:
        self._others = others
        self._parcels = Parcels(MOST_BYTES)
        self._packed: dict[str, bytes] = {}
        self._decoded: OrderedDict[str, Polymesh] = OrderedDict()

    def receive(self, record: LogRecord) -> None:
        """A record of the topic "picture_part"."""
        names = record.names
        whole = self._parcels.take(names["site"], names["picture"], names["part"], record.message)
        if whole is None:
            return
        try:
            sheet = sheet_of(unpacked_page(whole))
        except PageError as fault:
            log.error("event=picture_refused site=%s digest=%s reason=%r", names["site"], names["picture"], str(fault))
            return
        self._packed[sheet.digest] = whole
        self._keep(sheet)

    def __getitem__(self, digest: str) -> Polymesh:
        if digest in self._others:
            return self._others[digest]
        if digest not in self._decoded:
            self._keep(sheet_of(unpacked_page(self._packed[digest])))
        return self._decoded[digest]

    def __contains__(self, digest: object) -> bool:
        return digest in self._others or digest in self._packed

    def __iter__(self) -> Iterator[str]:
        yield from self._others
        yield from self._packed.keys() - self._others.keys()

    def __len__(self) -> int:
        return len(self._others.keys() | self._packed.keys())

    def _keep(self, sheet: Polymesh) -> None:
        self._decoded[sheet.digest] = sheet
        while len(self._decoded) > DECODED:
            self._decoded.popitem(last=False)
