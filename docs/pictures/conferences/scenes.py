"""Moments of conferences that are drawn again and again: for the pictures of the documentation, and as what tests of looks compare
with (tests/looks/test_looks.py).

Everything goes the way it goes live: a world is stepped, what it says is told to the renderer's stage, and its studio draws it.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vistel.arrays import F64, U8
from vistel.conference.files import load
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.grip import closed_round
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.hands import OPEN, RELAXED, hand_rotation
from vistel.figure.posture.posture import ELBOW, SHOULDER, WRIST, Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_rotvec, rotation_y, rotvec_from_matrix
from vistel.messages.world.encode import world_state
from vistel.render.config import render_config
from vistel.render.figures.people import load_figure
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow, Stage
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import Camera, look_at
from vistel.render.view.screens import Stereo
from vistel.space.files.interior import Interior
from vistel.space.inputs import CommandInput, MotionInput, ParticipantBody, StepInputs
from vistel.space.people import HAND_JOINT, build_like
from vistel.space.room import Room, meeting_room
from vistel.space.world import World
from vistel.v1 import motion_pb2
from vistel.wire.motion import MotionEncoder, MotionSample
from vistel.wire.motion.proportions import to_message
from vistel.wire.world.decoder import WorldDecoder
from vistel_sim.motion.open import open_motion

ROOT = Path(__file__).resolve().parents[3]
STEP_NS = 16_666_667
UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Moment:
    """What is drawn. camera: from where, None as the view says; decor: the room of a file, None the built-in one."""

    view: View
    instant: Instant
    camera: Camera | None = None
    seats: int = 3
    decor: Interior | None = None


def photograph(
    moment: Moment, width: int, height: int, light: str = "fine", prepare: Callable[[SceneRenderer], None] | None = None
) -> U8:
    """(height, width, 3), first row at the top. prepare: is given the studio before it draws."""
    for person in moment.instant.people:
        load_figure(person.about)  # a figure that has to be made is made sooner while nothing is drawn
    studio = SceneRenderer(replace(moment.view, width=width, height=height, light=light), moment.seats, load_figure, moment.decor)
    try:
        studio.painter.saves_shadows = False
        studio.camera = moment.camera
        if prepare is not None:
            prepare(studio)
        picture = studio.render(moment.instant)
        while not studio.complete:
            time.sleep(0.02)
            picture = studio.render(moment.instant)
        return picture[::-1, :, :3].copy()
    finally:
        studio.close()


def choreographed(file: Path, site: int, t_s: float) -> Moment:
    """Everybody of a conference as the built-in choreography has them."""
    conference = load(file)
    config = render_config(conference, conference.sites[site])
    motion = open_motion(conference)
    people = [
        PersonNow(
            ParticipantInfo(p.name, p.display_name or p.name, p.avatar, p.height),
            motion.posture(p.name, t_s),
            Timing(0, 0, 0, False),
        )
        for s in conference.sites
        for p in s.participants
    ]
    room = meeting_room(conference.room.seats)
    world = PlayoutWorld(1, {t.id: Pose(t.position, t.rotation) for t in room.things})
    view = replace(config.view, stereo=Stereo.MONO)
    return Moment(view, Instant(0, tuple(people), world, {t.id: t for t in room.things}), None, config.seats)


def three_at_the_table() -> Moment:
    """From the room."""
    moment = choreographed(ROOT / "examples" / "conferences" / "v-wall.toml", 0, 6.4)
    return replace(moment, view=replace(moment.view, kind="room", screens=()))


class Played:
    """People in a room, from step to step, as a renderer is told of them."""

    def __init__(self, interior: Interior | None = None, /, **avatars: str) -> None:
        """interior: the room of a file, None the built-in one."""
        self._interior = interior
        self.world, self._k = World(interior.room if interior else meeting_room(3)), 0
        self.avatars = {name: builtin_avatar(said, name=name, height=1.75) for name, said in avatars.items()}
        self._stage, self._decoder = Stage(0), WorldDecoder()
        self._encoders = {name: MotionEncoder() for name in avatars}
        for name, said in avatars.items():
            limbs = self.limbs(name)
            about = motion_pb2.Participant(participant=name, display_name=name.title(), avatar=said, height_m=1.75)
            about.proportions.CopyFrom(to_message(limbs.names, limbs.joint, limbs.arrays))
            self._stage.receive_participant(about)

    def limbs(self, name: str) -> Proportions:
        avatar = self.avatars[name]
        return Proportions.of(avatar.skeleton, avatar.body)

    def step(self, *asked: CommandInput, **postures: Posture) -> None:
        """A sixtieth of a second. asked: commands."""
        self._k += 1
        t_ns = self._k * STEP_NS
        people = tuple(ParticipantBody(n, proportions=self.limbs(n)) for n in postures) if self._k == 1 else ()
        motions = tuple(MotionInput(n, p, self._k, t_ns) for n, p in sorted(postures.items()))
        view = self.world.step(StepInputs(self._k, t_ns, people, motions, commands=asked))
        for name, posture in postures.items():
            stance = np.append(posture.stance.position, posture.stance.heading)
            sample = MotionSample(self._k, t_ns, posture.dofs, posture.hands, stance)
            self._stage.receive_motion(name, self._encoders[name].encode(sample), t_ns)
        for now in self._decoder.read(world_state(view)):
            self._stage.receive_world(now, t_ns)
        self._now = self._stage.instant(t_ns)

    def now(self, camera: Camera) -> Moment:
        decor = self._interior and replace(self._interior, room=Room((), (), shell=self._interior.room.shell))
        return Moment(View(640, 360, "room", ""), self._now, camera, decor=decor)


def reaching(like: Proportions, palm: F64, fingers: F64, facing: F64, heading: float, angles: F64, elbow: float = 1.0) -> Posture:
    """Somebody who looks along `heading`, the right palm at `palm` [m, room], fingers along `fingers`, the palm to `facing`."""
    skeleton = like.skeleton
    dofs = standing().dofs.copy()
    raised = matrix_from_rotvec(np.array([-0.5, 0.0, 0.0])) @ matrix_from_rotvec(dofs[SHOULDER["right"]])
    dofs[SHOULDER["right"]] = rotvec_from_matrix(np.ascontiguousarray(raised))
    dofs[ELBOW["right"]] = elbow
    hands = np.stack([RELAXED, angles])
    pose = pose_joints(skeleton, Posture(dofs, stance=Stance(np.zeros(3), heading)))
    forearm = pose.rotation[JOINT_INDEX["right_lower_arm"]]
    dofs[WRIST["right"]] = rotvec_from_matrix(np.ascontiguousarray(forearm.T @ hand_rotation(-1.0, fingers, facing)))
    pose = pose_joints(skeleton, Posture(dofs, hands, Stance(np.zeros(3), heading)))
    j = HAND_JOINT[1]
    reached = pose.position[j] + pose.rotation[j] @ build_like(like).palm[1]
    return Posture(dofs, hands, Stance(palm - reached, heading))


def handshake() -> Moment:
    """Two people beside the table who shake hands, fingers round the edge of each other's; both hands give way."""
    play = Played(ann="builtin:person=erik", bob="builtin:person=carla")
    place, ahead, sideways = np.array([2.0, 1.02, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    fingers = math.cos(0.45) * ahead - math.sin(0.45) * UP
    straight = np.concatenate((RELAXED[:4], 0.3 * RELAXED[4:]))
    grip = straight.copy()
    grip[[4, 8, 12, 16]] += 0.25
    grip[[6, 10, 14, 18]] += 0.5
    half = rotation_y(np.pi)
    for k in range(30):
        met = min(1.0, k / 22)
        angles = straight + (grip - straight) * max(0.0, met - 0.4) / 0.6
        palm = -0.03 * (1.0 - met) * sideways - 0.01 * ahead
        play.step(
            ann=reaching(play.limbs("ann"), place + palm, fingers, sideways, 0.0, angles),
            bob=reaching(play.limbs("bob"), place + half @ palm, half @ fingers, half @ sideways, np.pi, angles),
        )
    return play.now(look_at(place + np.array([-0.95, 0.28, 0.10]), place + np.array([0.0, 0.02, 0.0]), math.radians(30.0)))


def hand_on_ball() -> Moment:
    """Somebody takes the ball off the table from above and holds it."""
    play = Played(ann="builtin:person=erik")
    like, avatar = play.limbs("ann"), play.avatars["ann"]
    fist = closed_round(avatar.skeleton, avatar.body, "right", build_like(like).palm[1] - np.array([0.0, 0.012, 0.0]), 0.012)
    ball = play.world.room.thing("ball").position + np.array([0.0, 0.040, 0.0])
    ahead = np.array([0.0, 0.0, 1.0])

    def posture(height: float, closing: float) -> Posture:
        return reaching(like, ball + height * UP, ahead, -UP, 0.0, OPEN + closing * (fist - OPEN), elbow=0.6)

    for k in range(70):
        play.step(ann=posture(0.1 * max(0.0, 1.0 - k / 20), min(1.0, max(0.0, k - 22) / 30)))
    for k in range(25):
        play.step(ann=posture(0.12 * (k + 1) / 25, 1.0))
    at = ball + 0.11 * UP
    return play.now(look_at(at + np.array([-0.42, 0.10, 0.34]), at, math.radians(38.0)))


def face() -> Moment:
    """Somebody's face, a little from the side."""
    about = ParticipantInfo("ann", "Ann", "builtin:person=erik", 1.75)
    avatar = builtin_avatar(about.avatar, name="ann", height=1.75)
    posture = replace(standing(), stance=Stance(np.array([1.6, 0.0, 0.4]), math.radians(-70.0)))
    eye = pose_joints(avatar.skeleton, posture).position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0)
    ahead = np.array([math.sin(math.radians(-70.0)), 0.0, math.cos(math.radians(-70.0))])
    side = np.array([ahead[2], 0.0, -ahead[0]])
    at = eye - 0.03 * UP
    camera = look_at(at + 0.78 * ahead + 0.26 * side + 0.04 * UP, at, math.radians(26.0))
    instant = Instant(0, (PersonNow(about, posture, Timing(0, 0, 0, False)),), PlayoutWorld(1, {}), {})
    return Moment(View(640, 360, "room", ""), instant, camera)


SCENES: dict[str, Callable[[], Moment]] = {
    "table": three_at_the_table,
    "handshake": handshake,
    "hand-on-ball": hand_on_ball,
    "face": face,
}

__all__ = ["SCENES", "Moment", "photograph"]
