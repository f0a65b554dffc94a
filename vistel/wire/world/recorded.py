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
        self._begun_ns = 0
        """The time of the whole message that was begun with last."""

    @property
    def sound(self) -> bool:
        """Whether the room is known now, and nothing so far was other than the world said it should be."""
        return not self._decoder.lost and self._decoder.differed == 0

    def take(self, record: LogRecord) -> list[RoomState]:
        """The steps that a record completes, in order."""
        if record.topic.name == "world_key":
            self._snapshot.key(record.message)
            return []
        if record.topic.name == "world_detail":
            self._decoder.receive_detail(record.message)
            return []
        self._snapshot.add(record.message)
        steps = self._decoder.read(record.message)
        if not self._decoder.lost:
            return steps
        now = self._decoder.begin(self._snapshot.snapshot())
        if now is None or now.t_ns == self._begun_ns:
            return []
        self._begun_ns = now.t_ns
        return [now]
