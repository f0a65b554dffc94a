"""What people do at 60 Hz, for the motion codec: recorded bodies, hands and faces put together, bare or through devices.

A stream is one array (n, NUMBERS) in the order of `MOTION_FIELDS`. No recording holds body, hands and face at once, so a
body gets the hands and the face of other recordings, played to and fro.
"""

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.leap import finger_angles
from vistel.arrays import F64
from vistel.capture.body import BodyCapture
from vistel.capture.config import Person
from vistel.capture.one_euro import AngleFilter
from vistel.conference.model import Conference
from vistel.figure.face.marks import Expressions
from vistel.figure.posture.posture import Posture, Stance
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix, rotvec_from_matrix
from vistel.protocol.glove_calibration import default_calibration
from vistel.protocol.live_link_face import CHANNELS
from vistel.v1.device_pb2 import TrackerFrame, TrackerReceiver
from vistel.wire.motion_codec.layout import NUMBERS, PLACES
from vistel_sim.motion import open_motion
from vistel_sim.motion.bvh import parse_bvh
from vistel_sim.motion.source import MotionSource, SimulatedPerson, simulated_people
from vistel_sim.phone import talking

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data"
RATE_HZ = 60
NOISE_M, NOISE_RAD = 0.0008, math.radians(0.15)
"""Of a FASTRAK, standard deviation per axis."""
STATIONS = {1: "chest", 2: "head", 3: "left_hand", 4: "right_hand"}
SETTLE = 30
"""Frames left out in which the filters begin."""
BODIES = {
    "cmu 131_01": ("cmu/131_01.bvh", 0, 16),
    "cmu 18_01": ("cmu/18_01.bvh", 0, 20),
    "kth giver": ("kth_handover/take_new", 0, 13),
    "kth taker": ("kth_handover/take_new", 1, 13),
}
HANDS = ("grab", "HandSplay-110fps", "pinch", "wave")


@dataclass(frozen=True)
class StreamSource:
    """What a stream is put together from: name in BODIES, two of HANDS, and whose face ("recorded", "made up")."""

    body: str
    hands: tuple[str, str]
    face: str
    seed: int


HALVES = (
    (
        StreamSource("cmu 131_01", ("grab", "HandSplay-110fps"), "recorded", 1),
        StreamSource("kth giver", ("HandSplay-110fps", "grab"), "recorded", 2),
    ),
    (StreamSource("cmu 18_01", ("pinch", "wave"), "made up", 3), StreamSource("kth taker", ("wave", "pinch"), "made up", 4)),
)
"""The codec's model is learnt from the second half and made-up people, and measured on the first."""


def streams(recorded: StreamSource) -> Iterator[tuple[str, F64]]:
    """As recorded; and as the posture service would say it, from a FASTRAK and two CyberGloves."""
    file, who, seconds = BODIES[recorded.body]
    conference = _conference(str(DATA / "body" / file), 0)
    source, simulated = open_motion(conference), list(simulated_people(conference).values())[who]
    times = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    hands = [_to_and_fro(finger_angles(DATA / "hand/leap" / f"{n}.json.lz", RATE_HZ), len(times)) for n in recorded.hands]
    more = _more(len(times))
    bare = _put(np.array([_body(source.posture(simulated.name, t)) for t in times]), np.stack(hands, 1), recorded, more)
    yield f"{recorded.body}, as recorded", bare
    sensed, at = through_devices(source, simulated, seconds, recorded.seed)
    rows = np.minimum((at * RATE_HZ).astype(int), len(times) - 1)
    gloves = np.stack([_glove(h[rows], recorded.seed + i) for i, h in enumerate(hands)], 1)
    yield f"{recorded.body}, from devices", _put(sensed, gloves, recorded, more)


def seated(seed: int, seconds: float, face: str = "recorded") -> Iterator[tuple[str, F64]]:
    """A person of the built-in meeting: sits, speaks, gestures; bare and through devices."""
    conference = _conference("meeting", seed)
    source, simulated = open_motion(conference), simulated_people(conference)["b"]
    recorded = StreamSource("meeting", ("", ""), face, seed)
    postures = [source.posture(simulated.name, k / RATE_HZ) for k in range(int(seconds * RATE_HZ))]
    hands = np.array([p.hands for p in postures])
    yield "seated speaker, as made", _put(np.array([_body(p) for p in postures]), hands, recorded, None)
    sensed, at = through_devices(source, simulated, seconds, seed)
    angles = np.array([source.hand_angles(simulated.name, t) for t in at])
    gloves = np.stack([_glove(angles[:, i], seed + i) for i in range(2)], 1)
    yield "seated speaker, from devices", _put(sensed, gloves, recorded, None)


def through_devices(source: MotionSource, simulated: SimulatedPerson, seconds: float, seed: int) -> tuple[F64, F64]:
    """(n, 29) body and stance as solved from four noisy receivers, one station every 1/120 s; (n,) their times [s]."""
    rng = np.random.default_rng(seed)
    person = Person(
        name=simulated.name,
        display_name="",
        avatar="",
        height_m=simulated.skeleton.height,
        seat=Stance(simulated.seat_position, simulated.seat_heading),
        tracker="t",
        stations=STATIONS,
        transmitter=simulated.transmitter,
        gloves={},
    )
    capture = BodyCapture(person, simulated.skeleton)
    newest: dict[int, TrackerReceiver] = {}
    rows: list[F64] = []
    times: list[float] = []
    for k in range(int(seconds * 120)):
        station = 1 + k % len(STATIONS)
        p, q = source.receivers(simulated.name, k / 120)[STATIONS[station]]
        r = TrackerReceiver(station=station, t_ns=10**9 + k * 10**9 // 120, health=TrackerReceiver.HEALTH_GOOD)
        r.position.x, r.position.y, r.position.z = p + NOISE_M * rng.standard_normal(3)
        turned = matrix_from_rotvec(NOISE_RAD * rng.standard_normal(3)) @ matrix_from_quaternion(q)
        r.rotation.x, r.rotation.y, r.rotation.z, r.rotation.w = quaternion_from_matrix(turned)
        newest[station] = r
        if capture.tracker(TrackerFrame(device="t", receivers=newest.values())):
            rows.append(_body(capture.solve(capture.newest_ns).posture))
            times.append(k / 120)
    return np.array(rows[SETTLE:]), np.array(times[SETTLE:])


def posture_of(row: F64) -> Posture:
    """One frame of a stream."""
    stance = row[PLACES["stance"]]
    hands = row[PLACES["hands"]].reshape(2, 20)
    return Posture(row[PLACES["body"]], hands, Stance(stance[:3], float(stance[3])), row[PLACES["gaze"]])


def _conference(motion: str, seed: int) -> Conference:
    people = [{"name": name, "motion": motion} for name in "abc"[: 3 if motion == "meeting" else 2]]
    return Conference.model_validate({"seed": seed, "sites": [{"name": "here", "participants": people}]})


def _body(p: Posture) -> F64:
    return np.concatenate((p.dofs, p.stance.position, (p.stance.heading,)))


def _put(body: F64, hands: F64, recorded: StreamSource, more: F64 | None) -> F64:
    n = len(body)
    out = np.zeros((n, NUMBERS))
    out[:, PLACES["body"]], out[:, PLACES["stance"]] = body[:, :25], body[:, 25:]
    out[:, PLACES["hands"]] = hands.reshape(n, 40)
    channels = _recorded_face(n) if recorded.face == "recorded" else _made_up_face(n, recorded.seed)
    faces = Expressions(CHANNELS)
    out[:, PLACES["face"]] = [faces.marks(c).reshape(-1) for c in channels]
    out[:, PLACES["gaze"]] = [faces.gaze(c) for c in channels]
    blink = [CHANNELS.index("eyeBlinkLeft"), CHANNELS.index("eyeBlinkRight")]
    out[:, PLACES["lids"]] = 1.0 - channels[:, blink]
    out[:, PLACES["jaw"].start] = 0.3 * channels[:, CHANNELS.index("jawOpen")]
    if more is not None:
        out[:, PLACES["legs"].start : PLACES["collars"].stop] = more[:n]
    return out


def _recorded_face(n: int) -> F64:
    with (DATA / "face/arkit/dao_000_107.csv").open() as file:
        names, *rows = list(csv.reader(file))
    table = np.array(rows, np.float64)
    columns = [[c.lower() for c in names].index(c.lower()) for c in CHANNELS]
    frames = np.arange(table[0, 0], table[-1, 0] + 1)
    return _to_and_fro(np.stack([np.interp(frames, table[:, 0], table[:, c]) for c in columns], 1), n)


def _made_up_face(n: int, seed: int) -> F64:
    rng = np.random.default_rng(seed)
    out = np.array([talking(100.0 * seed + k / RATE_HZ) for k in range(n)])
    # A face is never still: every expression wanders a little, and the phone's own noise comes on top.
    wander = np.cumsum(rng.normal(0.0, 0.01, out.shape), 0)
    wander -= np.stack([np.convolve(w, np.ones(61) / 61, "same") for w in wander.T], 1)
    return np.clip(out + 0.05 + wander + rng.normal(0.0, 0.001, out.shape), 0.0, 1.0)


def _glove(angles: F64, seed: int) -> F64:
    """(n, 20) as a CyberGlove with 22 sensors counts them and the posture service filters them."""
    rng, calibration, calm = np.random.default_rng(seed), default_calibration(), AngleFilter()
    out: list[F64] = []
    for k, row in enumerate(angles):
        counts = np.array(calibration.counts(row.tolist(), 22)) + 0.3 * rng.standard_normal(22)
        seen = np.array(calibration.angles(bytes(np.clip(np.rint(counts), 1, 255).astype(np.uint8))))
        out.append(calm.update(k / RATE_HZ, seen))
    return np.array(out)


def _more(n: int) -> F64:
    """(n, 30) legs and collar bones of a walking person, order of those parts."""
    bvh = parse_bvh(DATA / "body" / BODIES["cmu 18_01"][0])
    _, rotation = bvh.pose()
    at = {name: i for i, name in enumerate(bvh.names)}
    names = [f"{side}{part}" for side in "lr" for part in ("femur", "tibia", "foot", "toes")] + ["lclavicle", "rclavicle"]
    joints = [(at[name], bvh.parents[at[name]]) for name in names]
    table = np.array(
        [np.concatenate([rotvec_from_matrix(np.ascontiguousarray(r[p].T @ r[j])) for j, p in joints]) for r in rotation]
    )
    times = np.arange(0.0, len(table) - 1, 1.0 / (RATE_HZ * bvh.frame_s))
    return _to_and_fro(np.stack([np.interp(times, np.arange(len(table)), column) for column in table.T], 1), n)


def _to_and_fro(table: F64, n: int) -> F64:
    at = np.arange(n) % (2 * len(table) - 2)
    return table[np.where(at < len(table), at, 2 * len(table) - 2 - at)]
