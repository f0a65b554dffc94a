"""Motion on the wire: kbit/s and errors, beside floats, zstd and 16-bit numbers; losses; processor time; prediction.

Recorded bodies, hands and faces (`motion_streams`), none of which the codec's model was learnt from, bare and as the
posture service says them; a seated speaker is made up, for nobody has recorded one. Errors are those of all joints in
the room after forward kinematics, so that they add up along each limb. kbit/s are at 60 Hz.
"""

import errno
import struct
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import zstandard

from benchmarks.row import Row, at_most
from benchmarks.wire.motion_streams import DATA, HALVES, RATE_HZ, posture_of, seated, streams
from benchmarks.wire.predicted_motion import rows as prediction_rows
from vistel.arrays import F64
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import standard_skeleton
from vistel.v1.motion_pb2 import Motion
from vistel.wire.motion import LOSSES, MotionDecoder, MotionEncoder, MotionSample, warm_up
from vistel.wire.motion_codec.layout import COUNTS, GRAINS_TENTHS, NUMBERS, PLACES, USUAL_GRAIN

PARTS = ("body", "hands", "stance", "gaze", "face", "lids")
SENT = sum(COUNTS[part] for part in PARTS)
HEADER_BYTES = 16
FRAME_NS = 1_000_000_000 // RATE_HZ
START_NS = 1_000_000_000_000_000_000
LOST = (0.01, 0.05, 0.2)
TARGETS = {"moving": at_most(24), "seated": at_most(12)}
MOST_DEG, MOST_MM, MOST_US = at_most(0.2), at_most(1), at_most(100)


@dataclass(frozen=True)
class Sent:
    """A stream through the codec: messages and what they decode to; seconds of each frame's two ways."""

    messages: list[Motion]
    back: list[MotionSample]
    seconds: F64

    @property
    def payload(self) -> float:
        """kbit/s of the frames alone."""
        return _kbits(len(m.frame) for m in self.messages)

    @property
    def whole(self) -> float:
        """kbit/s of the messages as they are put on the bus."""
        return _kbits(m.ByteSize() for m in self.messages)


def run() -> Iterator[Row]:
    """One stream after the other, then all that was not learnt from."""
    if not (DATA / "body").is_dir():
        raise FileNotFoundError(errno.ENOENT, "no recordings", str(DATA / "body"))
    warm_up()
    named: list[tuple[str, F64]] = []
    for recorded in HALVES[0]:
        for name, rows in streams(recorded):
            named.append((name, rows))
            yield from _stream(name, rows, "moving")
    held_out = [rows for _, rows in named]
    for recorded in HALVES[1]:
        for name, rows in streams(recorded):
            yield from _stream(f"{name} (learnt from)", rows, None)
    for name, rows in seated(7, 30.0):
        yield from _stream(name, rows, "seated")
    yield from _curve(held_out)
    yield from _losses(held_out)
    yield from prediction_rows(named)


def samples(rows: F64) -> list[MotionSample]:
    """Of a stream, without the joints beyond the 25 degrees of freedom."""
    return [
        MotionSample(
            i + 1,
            START_NS + i * FRAME_NS,
            row[PLACES["body"]],
            row[PLACES["hands"]].reshape(2, 20),
            row[PLACES["stance"]],
            row[PLACES["gaze"]],
            row[PLACES["face"]],
            lids=row[PLACES["lids"]],
        )
        for i, row in enumerate(rows)
    ]


def send(rows: F64, encoder: MotionEncoder | None = None) -> Sent:
    """Through encoder and decoder, nothing lost."""
    encoder, decoder = encoder or MotionEncoder(), MotionDecoder()
    messages: list[Motion] = []
    back: list[MotionSample] = []
    seconds: list[float] = []
    for sample in samples(rows):
        started = time.thread_time()
        message = encoder.encode(sample)
        decoded = decoder.decode(message)
        seconds.append(time.thread_time() - started)
        assert decoded is not None
        message.header.version = 1
        messages.append(message)
        back.append(decoded)
    return Sent(messages, back, np.array(seconds))


@dataclass(frozen=True)
class Errors:
    """Of every joint in the room, frame by frame: turned by [deg], off by [mm]; and how much more the joints move from
    frame to frame than they were given to, root mean square [mm]."""

    turned: F64
    off: F64
    given_mm: float
    sent_mm: float


def errors(rows: F64, back: Sequence[MotionSample]) -> Errors:
    """What the codec does to a stream."""
    skeleton = standard_skeleton(1.75)
    given = [pose_joints(skeleton, posture_of(row)) for row in rows]
    sent = [pose_joints(skeleton, posture_of(_row(sample))) for sample in back]
    chords = [np.linalg.norm(a.rotation - b.rotation, axis=(1, 2)) for a, b in zip(given, sent, strict=True)]
    turned = np.degrees(2 * np.arcsin(np.minimum(1.0, np.array(chords) / (2 * np.sqrt(2)))))
    a, b = (1e3 * np.array([pose.position for pose in poses]) for poses in (given, sent))
    moves = [float(np.sqrt((np.diff(p, axis=0) ** 2).sum(-1).mean())) for p in (a, b)]
    return Errors(turned, np.linalg.norm(a - b, axis=-1), *moves)


def _stream(name: str, rows: F64, kind: str | None) -> Iterator[Row]:
    sent = send(rows)
    found = errors(rows, sent.back)
    degrees, millimetres = float(np.percentile(found.turned, 99)), float(np.percentile(found.off, 99))
    for metric, value in (("payload", sent.payload), ("payload and envelope", sent.whole)):
        target = TARGETS.get(kind or "") if metric == "payload" else None
        for peer, other in _peers(rows).items():
            yield Row("motion", name, metric, "kbit/s", value, peer, other, target=target)
    for losses in LOSSES[1:]:
        payload = send(rows, MotionEncoder(losses=losses)).payload
        yield Row("motion", name, f"payload, for {losses} losses", "kbit/s", payload)
    for metric, unit, value, most in (
        ("joint error p99", "deg", degrees, MOST_DEG),
        ("joint position error p99", "mm", millimetres, MOST_MM),
    ):
        yield Row("motion", name, metric, unit, value, target=most)
    marks = 1e3 * max(
        float(np.abs(row[PLACES["face"]] - s.face).max()) for row, s in zip(rows, sent.back, strict=True) if s.face is not None
    )
    yield Row("motion", name, "mark error max", "mm", marks, target=MOST_MM)
    yield Row("motion", name, "movement from frame to frame", "mm", found.sent_mm, "as given", found.given_mm)
    value = 1e6 * float(np.median(sent.seconds))
    yield Row("motion", name, "encode and decode", "us", value, target=MOST_US)
    for every, of in ((1, "every"), (6, "one in six")):
        value = 1e6 * _receiving(sent.messages, every)
        yield Row("motion", name, f"receiving, {of} frame drawn", "us per frame", value)


def _receiving(messages: Sequence[Motion], every: int) -> float:
    """Processor time [s] for each message, of which one in `every` is worked out; median of five rounds."""
    rounds: list[float] = []
    for _ in range(5):
        decoder = MotionDecoder()
        started = time.thread_time()
        for i, message in enumerate(messages):
            frame = decoder.open(message)
            if frame is not None and i % every == 0:
                frame.sample()
        rounds.append((time.thread_time() - started) / len(messages))
    return float(np.median(rounds))


def _curve(held_out: Sequence[F64]) -> Iterator[Row]:
    """All that was not learnt from, at finer and coarser steps."""
    for grain, tenths in enumerate(GRAINS_TENTHS):
        sent = [send(rows, MotionEncoder(grain=grain)) for rows in held_out]
        found = [errors(rows, s.back) for rows, s in zip(held_out, sent, strict=True)]
        case = f"all, steps x {tenths / 10:g}" + (" (usual)" if grain == USUAL_GRAIN else "")
        payload = float(np.mean([s.payload for s in sent]))
        yield Row("motion", case, "payload", "kbit/s", payload)
        for metric, unit, each in (
            ("joint error p99", "deg", [f.turned for f in found]),
            ("joint position error p99", "mm", [f.off for f in found]),
        ):
            value = float(np.percentile(np.concatenate(each), 99))
            yield Row("motion", case, metric, unit, value)


def _losses(held_out: Sequence[F64]) -> Iterator[Row]:
    """Share of the frames that arrive which can be read, and the longest time without one."""
    for losses in LOSSES:
        for loss in LOST:
            rng = np.random.default_rng(5)
            readable, longest = [], 0
            for rows in held_out:
                decoder, since = MotionDecoder(), 0
                for message in send(rows, MotionEncoder(losses=losses)).messages:
                    arrived = rng.random() >= loss
                    read = arrived and decoder.decode(message) is not None
                    readable += [read] if arrived else []
                    since = 0 if read else since + 1
                    longest = max(longest, since)
            case = f"{loss:.0%} lost, for {losses} losses"
            yield Row("motion", case, "arrived frames that decode", "%", 100 * float(np.mean(readable)))
            yield Row("motion", case, "longest gap", "ms", longest * 1e3 / RATE_HZ)


def _peers(rows: F64) -> dict[str, float]:
    """kbit/s of the same frames otherwise."""
    used = [rows[:, PLACES[part]] for part in PARTS]
    table = np.concatenate(used, 1).astype(np.float32)
    compressor = zstandard.ZstdCompressor(level=3)
    packed = [struct.pack("<BH", 10, 4 * SENT) + row.tobytes() for row in table]
    return {
        f"{SENT} float32": _kbits(HEADER_BYTES + 4 * SENT for _ in table),
        f"protobuf floats, zstd {zstandard.__version__}": _kbits(HEADER_BYTES + len(compressor.compress(p)) for p in packed),
        f"{SENT} x 16 bits": _kbits(HEADER_BYTES + 2 * SENT for _ in table),
    }


def _kbits(sizes: Iterable[int]) -> float:
    found = list(sizes)
    return sum(found) / len(found) * RATE_HZ * 8 / 1000


def _row(s: MotionSample) -> F64:
    out = np.zeros(NUMBERS)
    for part in PARTS:
        values = getattr(s, part)
        if values is not None:
            out[PLACES[part]] = np.reshape(values, -1)
    return out
