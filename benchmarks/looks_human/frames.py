"""Pictures of people and what is true in them: busts, postures and tables, in both lights, as PNG files and frames.json."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from benchmarks.looks_human.makehuman import PEERS, has_peers, peer
from benchmarks.looks_human.truth import distances, truth_of
from benchmarks.progress import part
from vistel.arrays import F64, U8
from vistel.conference.model import Conference, Participant, Site
from vistel.figure.body_model.builtin_people import PEOPLE
from vistel.figure.posture.posture import Posture, Stance, pose_joints, standing
from vistel.figure.posture.standard import standard_postures
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.pose import Pose
from vistel.render.figures.cache import cached_figure
from vistel.render.figures.figures import AvatarFigure
from vistel.render.figures.people import load_figure
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import Camera, look_at
from vistel.render.view.view import View
from vistel.space.room import meeting_room
from vistel_sim.motion.open import open_motion

LIGHTS = ("fine", "fast")
SIZE = (640, 360)
"""Of the demo's pictures, unless its file says otherwise [pixels]."""
PLACE, HEADING = np.array((1.6, 0.0, 0.4)), math.radians(-70.0)
"""Where in the room people stand by themselves [m], and which way they look [rad]."""
BUST_M, BUST_FIELD = 0.9, 0.55
"""From how far a bust is taken, and the picture's height as an angle [rad]."""
BUST_ANGLES = 0.0, 30.0
"""How far from the front [degrees]."""
AWAY_M = (1.6, 2.4, 3.4)
"""From how far postures are taken."""
POSTURE_FIELD = math.radians(68.0)
"""The picture's height as an angle; a body that stands fits in from the nearest [rad]."""
FROM_SIDE = math.radians(20.0)
"""How far from the front [rad]."""
TIMES_S = tuple(2.0 + 2.7 * k for k in range(16))
"""Moments of the demo's meeting [s]."""
SEATS = 3
NO_TIMING = Timing(0, 0, 0, False)


def frames(folder: Path, thorough: bool) -> list[dict[str, Any]]:
    """Draws all pictures into `folder`. Raises NoOpenGlError where nothing can be drawn."""
    out: list[dict[str, Any]] = []
    alone = [*PEOPLE, *(PEERS if has_peers() else ())]
    with Studio() as studio:
        for drawn in (_busts(studio, alone), _postures(studio, alone, thorough), *_tables(studio, thorough)):
            for told, pictures in drawn:
                for light, picture in pictures.items():
                    file = f"{len(out):04}.png"
                    Image.fromarray(picture).save(folder / file, compress_level=1)
                    hands = [hand["square"] for person in told["people"] for hand in person["hands"]]
                    out.append({"file": file, "light": light, "hands": hands, **told})
    (folder / "frames.json").write_text(json.dumps(out), "utf-8")
    return out


Drawn = Iterator[tuple[dict[str, Any], dict[str, U8]]]
"""What is told of a picture, and the picture in each light."""


class Studio:
    """The renderer as a site has it. It remembers people's figures."""

    def __init__(self) -> None:
        self._figures: dict[str, AvatarFigure] = {}
        self._renderer = SceneRenderer(View(*SIZE, "room", "", light="fine"), SEATS, self._load)
        self._renderer.painter.saves_shadows = False

    def __enter__(self) -> "Studio":
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()

    def figure(self, about: ParticipantInfo) -> AvatarFigure:
        """The figure that is drawn of somebody."""
        if about.name not in self._figures:
            self._load(about)
        return self._figures[about.name]

    def draw(self, instant: Instant, sees: Camera | str, lights: tuple[str, ...] = LIGHTS) -> tuple[list[Any], dict[str, U8]]:
        """The truth of everybody in a picture, and the picture in each light. sees: a camera, or through whose eyes."""
        renderer = self._renderer
        eyes, renderer.camera = (sees, None) if isinstance(sees, str) else ("", sees)
        renderer.view = replace(renderer.view, kind="seat" if eyes else "room", eyes=eyes, names=bool(eyes))
        # The depth of what is drawn is kept in fine light only.
        renderer.relight("fine")
        fine = self._settled(instant)
        (sight,), metres, people = renderer._from, self._metres(), []
        for person in instant.people:
            if person.about.name != eyes:
                skeleton = self.figure(person.about).skeleton
                pose = pose_joints(skeleton, person.posture)
                people.append(truth_of(person.about.name, skeleton, pose, sight.camera, metres))
        drawn: dict[str, U8] = {}
        for light in lights:
            renderer.relight(light)
            drawn[light] = np.ascontiguousarray((fine if light == "fine" else self._settled(instant))[::-1, :, :3])
        return people, drawn

    def _settled(self, instant: Instant) -> U8:
        """Levels of detail are chosen by how large people were in the picture before."""
        self._renderer.render_complete(instant)
        return self._renderer.render(instant)

    def _metres(self) -> F64:
        canvas = self._renderer.painter._canvas
        assert canvas.depth is not None
        depth = np.frombuffer(canvas.depth.read(), np.float32).reshape(canvas.size[::-1])
        return distances(depth[::-1].astype(np.float64))

    def _load(self, about: ParticipantInfo) -> AvatarFigure:
        figure = cached_figure(peer(about.avatar)) if about.avatar in PEERS else load_figure(about)
        self._figures[about.name] = figure
        return figure


def _about(name: str) -> ParticipantInfo:
    height = PEOPLE[name].height if name in PEOPLE else None
    return ParticipantInfo(name, name.title(), f"builtin:person={name}" if name in PEOPLE else name, height or 1.75)


def _alone(about: ParticipantInfo, posture: Posture) -> Instant:
    here = replace(posture, stance=Stance(PLACE, HEADING))
    return Instant(0, (PersonNow(about, here, NO_TIMING),), PlayoutWorld(1, {}), {})


def _before(middle: F64, angle: float, away: float, up: float, field_of_view: float) -> Camera:
    """A camera in front of somebody who stands at PLACE, by `angle` [rad] from straight ahead."""
    way = np.array((math.sin(HEADING + angle), up, math.cos(HEADING + angle)))
    return look_at(middle + away * way, middle, field_of_view)


def _busts(studio: Studio, names: list[str]) -> Drawn:
    with part("busts", len(names)) as done:
        for name in names:
            about = _about(name)
            instant = _alone(about, standing())
            pose = pose_joints(studio.figure(about).skeleton, instant.people[0].posture)
            middle = pose.position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0) - (0.0, 0.06, 0.0)
            for angle in BUST_ANGLES:
                people, drawn = studio.draw(instant, _before(middle, math.radians(angle), BUST_M, 0.05, BUST_FIELD))
                yield {"kind": "bust", "who": name, "angle": angle, "people": people, "wants": ["near", "far"]}, drawn
            done()


def _postures(studio: Studio, names: list[str], thorough: bool) -> Drawn:
    """Each person in each of twelve postures; from one of three distances and in one light in turn, or `thorough`ly from all."""
    wanted = {k: v for k, v in standard_postures().items() if k != "t-pose"}
    with part("postures", len(names)) as done:
        for n, name in enumerate(names):
            about = _about(name)
            for k, (word, posture) in enumerate(wanted.items()):
                instant = _alone(about, posture)
                at = pose_joints(studio.figure(about).skeleton, instant.people[0].posture).position
                middle = 0.5 * (at.min(axis=0) + at.max(axis=0))
                for m, away in enumerate(AWAY_M):
                    if not thorough and (n + k) % len(AWAY_M) != m:
                        continue
                    camera = _before(middle, FROM_SIDE, away, 0.1, POSTURE_FIELD)
                    people, drawn = studio.draw(instant, camera, LIGHTS if thorough else (LIGHTS[(n + k) % 2],))
                    told = {"kind": "posture", "who": name, "posture": word, "away": away}
                    yield told | {"people": people, "wants": ["pose", "hands"]}, drawn
            done()


def _tables(studio: Studio, thorough: bool) -> Iterator[Drawn]:
    """The demo's three from each seat; and everybody in every seat, at two moments or `thorough`ly at all."""
    names = list(PEOPLE)
    yield _table(studio, "demo", names[:SEATS], TIMES_S)
    for n in range(1, len(names)):
        three = [names[(n + k) % len(names)] for k in range(SEATS)]
        yield _table(studio, "seats", three, TIMES_S if thorough else (TIMES_S[n], TIMES_S[-n]))


def _table(studio: Studio, kind: str, names: list[str], times: Sequence[float]) -> Drawn:
    """Three people at the table, as the choreography has them, through the eyes of each."""
    who = {name: _about(name) for name in names}
    sites = [Site(name=n, participants=[Participant(name=n, seat=k, height=a.height)]) for k, (n, a) in enumerate(who.items())]
    motion = open_motion(Conference(name="looks", sites=sites))
    room = meeting_room(SEATS)
    world = PlayoutWorld(1, {t.id: Pose(t.position, t.rotation) for t in room.things})
    things = {t.id: t for t in room.things}
    with part(f"table of {', '.join(names)}", SEATS * len(times)) as done:
        for seat, eyes in enumerate(names):
            for t in times:
                people = tuple(PersonNow(about, motion.posture(n, t), NO_TIMING) for n, about in who.items())
                seen, drawn = studio.draw(Instant(round(1e9 * t), people, world, things), eyes)
                told = {"kind": kind, "who": eyes, "seat": seat, "t": t}
                yield told | {"people": seen, "wants": ["far", "hands"]}, drawn
                done()
