"""The room from a log: the messages of a recorded world, one after the other, to rooms."""

from vistel.wire.log import LogRecord
from vistel.wire.world.decoder import RoomState, SnapshotBuilder, WorldDecoder

TOPICS = ("world_state", "world_key", "world_detail")
"""What of a log tells where everything is."""


class RecordedWorld:
    """Takes the records of `TOPICS` in the order of their arrival. A log that begins or is damaged in the middle of a
    conference is followed from the next whole message on."""

    def __init__(self) -> None:
        self._decoder = WorldDecoder()
        self._snapshot = SnapshotBuilder()
        self._begun = False
        """Whether the newest whole message was begun with: what could not be followed from there cannot be a second time."""

    @property
    def differed(self) -> int:
        """How often what was known was not what the world knew; it is found anew then from a whole message."""
        return self._decoder.differed

    def take(self, record: LogRecord) -> list[RoomState]:
        """The steps that a record completes, in order."""
        if record.topic.name == "world_key":
            self._snapshot.key(record.message)
            self._begun = False
            return []
        if record.topic.name == "world_detail":
            self._decoder.receive_detail(record.message)
            return []
        self._snapshot.add(record.message)
        steps = self._decoder.read(record.message)
        if not self._decoder.lost or self._begun:
            return steps
        self._begun = True
        now = self._decoder.begin(self._snapshot.snapshot())
        return [now] if now is not None else []
