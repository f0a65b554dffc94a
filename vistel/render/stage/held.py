"""Things in hands, drawn with the hands that are shown rather than where the world said a moment later that they are.

The world's word on a held thing comes after the motion it follows from, so the thing would trail behind its hand. What one
hand alone holds is therefore drawn where that hand is shown (prediction), as long as the world's own places for it lie on
the way the prediction took; where they do not, because the thing is pushed, pulled or taken, the world is followed. From the
one to the other the picture goes by an offset that fades, never by a jump.

A hand whose thing is not where it would have it, because others hold it too, furniture stops it or it has a tracker of its
own, is drawn at the thing all the same, and its arm follows: so it does not go through the thing.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import Posture
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, slerp
from vistel.geometry.smoothstep import ease
from vistel.render.stage.hand_correction import NO_OFFSET, ShownPerson, hand_offset, moved_hand, towards
from vistel.render.stage.world_view import PlayoutWorld, quaternion, vector
from vistel.space.people import HAND_JOINT
from vistel.v1 import geometry_pb2, world_pb2

BLEND_NS = 200_000_000
"""Time in which the offset between prediction and the world's word fades."""
BEHIND_NS = 300_000_000
"""How far the world's word may be behind."""
AGREES = 0.008
"""The world's place for a thing agrees with the prediction when it is this near to the predicted path [m]."""
DIFFERS = 0.020
"""It no longer agrees when it is this far off the path [m]."""
AT_FIRST = 0.15
"""The same in the first moments of a grasp, when the world's places lie before the beginning of the way [m]."""
FINGERS_S = 0.15
"""Time in which fingers come onto what they hold, and off it."""
FORGOTTEN_NS = 400_000_000
"""A thing that no hand has held for so long is like any other."""


@dataclass
class _Hand:
    """A hand that holds, or did a moment ago. share: how far it has come, 0 to 1; fingers: (20,) on the thing; lies: where
    that lies in it as it is drawn; off: by which it is drawn off its place, rotation vector (3,) and (3,) [m], room."""

    share: float
    fingers: F64
    lies: Pose
    off: tuple[F64, F64] = NO_OFFSET


@dataclass
class _Track:
    way: deque[tuple[int, F64]] = field(default_factory=deque[tuple[int, F64]])
    leads: bool = False
    hand: tuple[str, bool] | None = None
    drawn: Pose | None = None
    offset: Pose | None = None
    changed_ns: int = 0
    held_ns: int = 0


class HeldThings:
    """What hands hold, from picture to picture. Times are those of drawing [ns]."""

    def __init__(self) -> None:
        self._tracks: dict[str, _Track] = {}
        self._hands: dict[tuple[str, bool], _Hand] = {}
        self._last_ns = 0
        self._last: Mapping[str, Pose] = {}
        self._shown: Mapping[str, ShownPerson] = {}

    def poses(self, now_ns: int, world: PlayoutWorld, people: Mapping[str, ShownPerson]) -> PlayoutWorld:
        """The world with held things where they are drawn."""
        held: dict[str, list[world_pb2.Grasp]] = {}
        for g in world.grasps:
            held.setdefault(g.thing, []).append(g)
        poses = dict(world.poses)
        for thing in sorted(held.keys() | self._tracks.keys()):
            if thing not in poses:
                self._tracks.pop(thing, None)
                continue
            if thing not in self._tracks:
                self._tracks[thing] = _Track(drawn=self._last.get(thing))
            track = self._tracks[thing]
            poses[thing] = _drawn(track, now_ns, poses[thing], _predicted(held.get(thing, []), people), held.get(thing, []))
            if now_ns - track.held_ns > FORGOTTEN_NS:
                del self._tracks[thing]
        self._last, self._shown = poses, people
        return replace(world, poses=poses)

    def fingers(self, now_ns: int, world: PlayoutWorld, people: Mapping[str, Posture]) -> dict[str, Posture]:
        """Postures with the hands that hold something on it, after `poses` of the same picture."""
        seconds = 1e-9 * max(0, now_ns - self._last_ns)
        share = min(1.0, seconds / FINGERS_S)
        self._last_ns = now_ns
        holds = {(g.participant, g.right): g for g in world.grasps if len(g.fingers) == 20}
        for key in [*self._hands]:
            if key not in holds:
                hand = self._hands[key]
                hand.share -= share
                if hand.share <= 0.0:
                    del self._hands[key]
        for key, g in holds.items():
            wanted, lies = np.array(g.fingers, np.float64) * 1e-3, _pose(g.seen if g.HasField("seen") else g.hold)
            hand = self._hands.setdefault(key, _Hand(0.0, wanted, lies))
            hand.share, hand.fingers = min(1.0, hand.share + share), hand.fingers + share * (wanted - hand.fingers)
            hand.lies = towards(hand.lies, lies, seconds)
            thing, shown = self._last.get(g.thing), self._shown.get(g.participant)
            hand.off = NO_OFFSET if thing is None or shown is None else hand_offset(shown.joints, g.right, thing, hand.lies)
        out = dict(people)
        for (who, right), hand in self._hands.items():
            if who in out:
                u = ease(hand.share)
                own = out[who].hands
                hands = own.copy()
                hands[int(right)] += u * (hand.fingers - own[int(right)])
                posture = replace(out[who], hands=hands)
                out[who] = moved_hand(self._shown[who], posture, right, u, hand.off) if who in self._shown else posture
        return out


def _predicted(grasps: list[world_pb2.Grasp], people: Mapping[str, ShownPerson]) -> Pose | None:
    """Where the thing is in the one hand that holds it; None when several do, or who does is not shown."""
    if len(grasps) != 1 or grasps[0].participant not in people:
        return None
    g = grasps[0]
    joints, j = people[g.participant].joints, HAND_JOINT[int(g.right)]
    r, p = joints.rotation[j], joints.position[j]
    return _pose(g.hold).moved(r, p)


def _pose(p: geometry_pb2.Pose) -> Pose:
    return Pose(vector(p.position), quaternion(p.rotation))


def _drawn(track: _Track, now_ns: int, said: Pose, predicted: Pose | None, grasps: list[world_pb2.Grasp]) -> Pose:
    """Where the thing is drawn, and the track of it one picture on. said: by the world."""
    hand = (grasps[0].participant, grasps[0].right) if len(grasps) == 1 else None
    if grasps:
        track.held_ns = now_ns
    if hand != track.hand:
        track.way.clear()
    leads = False
    if predicted is not None:
        track.way.append((now_ns, predicted.position))
        while len(track.way) > 1 and now_ns - track.way[1][0] >= BEHIND_NS:
            track.way.popleft()
        off = _off_way(said.position, [p for _, p in track.way])
        # Until the way is as long as the world may be behind, its places lie before the way's beginning.
        young = now_ns - track.way[0][0] < BEHIND_NS - 1_000_000
        leads = off < (AT_FIRST if young else DIFFERS if track.leads else AGREES)
    target = predicted if leads and predicted is not None else said
    if (leads, hand) != (track.leads, track.hand) and track.drawn is not None:
        track.offset, track.changed_ns = _difference(track.drawn, target), now_ns
    track.leads, track.hand = leads, hand
    u = 1.0 - min(1.0, max(0.0, (now_ns - track.changed_ns) / BLEND_NS))
    if u <= 0.0:
        track.offset = None
    track.drawn = target if track.offset is None else _with(target, track.offset, ease(u))
    return track.drawn


def _off_way(p: F64, way: list[F64]) -> float:
    """From a place to a way of straight pieces [m]."""
    best = float(np.linalg.norm(p - way[-1]))
    for a, b in pairwise(way):
        along = b - a
        t = min(1.0, max(0.0, float((p - a) @ along) / max(1e-12, float(along @ along))))
        best = min(best, float(np.linalg.norm(p - a - t * along)))
    return best


def _difference(drawn: Pose, target: Pose) -> Pose:
    """What takes `target` to `drawn`."""
    turn = drawn.matrix @ target.matrix.T
    return Pose(drawn.position - target.position, quaternion_from_matrix(np.ascontiguousarray(turn)))


def _with(target: Pose, offset: Pose, share: float) -> Pose:
    turn = matrix_from_quaternion(slerp(np.array([0.0, 0.0, 0.0, 1.0]), offset.rotation, share))
    turned = quaternion_from_matrix(np.ascontiguousarray(turn @ target.matrix))
    return Pose(target.position + share * offset.position, turned)
