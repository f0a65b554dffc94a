"""From an instant to a picture: poses the figures, aims the camera, draws, hands the picture on. One thread owns it."""

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np

from vistel.arrays import F64, U8
from vistel.figure.body import PosedBody, pose_body
from vistel.figure.face.gaze import converged, distance_looked_at
from vistel.figure.posture.posture import JointPose, Posture, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.implicit.deformation.ghost_source import GhostSource
from vistel.render.figures.drawn import FigureView
from vistel.render.figures.figures import COARSER_BELOW, AvatarFigure, DrawableFigure, PosedVertices, StandIn, below_head, limb_rows
from vistel.render.figures.ghosts import Ghosts
from vistel.render.figures.gpu_deform import open_deformer
from vistel.render.figures.people import load_figure
from vistel.render.gl.antialias import antialias
from vistel.render.gl.context import open_surface
from vistel.render.interaction.interface import WindowSystem
from vistel.render.overlays.gauges import Rate, rows_of
from vistel.render.overlays.labels import Label
from vistel.render.overlays.overlays import LabelView
from vistel.render.painter import Frame, Painter
from vistel.render.preparation import take_figure, take_room
from vistel.render.room.room import Furniture, ShellPanel, build_room, drawn_with_room
from vistel.render.scene_things import ThingsShown
from vistel.render.stage.signs import sign_of
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.things.soft import pulls_of
from vistel.render.view.camera import Camera, SeatCamera, overview
from vistel.render.view.screens import Sight, eyes_apart, eyes_before, picture_size, sights_of_desktop, sights_of_screens
from vistel.render.view.view import Choices, Mode, View, choices_of
from vistel.space.files.interior import Interior
from vistel.space.files.model import Polymesh
from vistel.space.room import meeting_room

log = logging.getLogger("vistel.renderer")


ARM = 0.25
"""For the level of detail, people are taken to be so much nearer than their hips [m]."""
NEAREST = 0.45
"""For the level of detail, nobody is taken to be nearer than this [m]."""
_FINE = {"auto": None, "fast": False, "fine": True}
LOST = ("GL_UNKNOWN_ERROR", "GL_OUT_OF_MEMORY")
"""Errors after which nothing is drawn any more; the first is what moderngl makes of a lost context."""
NO_SIGNAL_NS = 1_500_000_000
EYES_SEEN = 350.0
"""Pixels per metre below which nobody sees that eyes converge."""


@dataclass
class _Cast:
    about: ParticipantInfo
    shape: DrawableFigure
    coming: Future[DrawableFigure] | None
    at: F64 | None = None
    head: F64 | None = None
    remark: str = ""

    @property
    def waiting(self) -> bool:
        """Their own figure is not there yet, and will be."""
        return self.coming is not None or (not self.about.here and isinstance(self.shape, StandIn))


class SceneRenderer:
    """Owns the surface. Create, use and close it in one thread."""

    def __init__(
        self,
        view: View,
        seats: int,
        load: Callable[[ParticipantInfo], DrawableFigure] = load_figure,
        decor: Interior | None = None,
        models: Mapping[str, Polymesh] | None = None,
        windows: WindowSystem | None = None,
    ) -> None:
        """decor: what of the room does not come from the world, and the models of things; default: the built-in room. models:
        those of things in place of decor's; more may come while it draws. windows: where pictures are shown; without, and where
        none can be opened, they are only returned."""
        self.view = view
        self._surface = open_surface(None if windows is None else windows.open)
        self.capability = self._surface.capability
        self._deformer = open_deformer(self._surface, view.engine)
        self._scale, self._screens = 1.0, view.screens
        self._rate = Rate()
        self._room = decor.room if decor else meeting_room(seats)
        looks: Mapping[str, Polymesh] = models if models is not None else decor.models if decor else {}
        self._looks = looks
        self._lights: dict[bool, tuple[Painter, ThingsShown]] = {}
        self.painter, self._furnishing = self._lit(_FINE[view.light], build_room(self._room) if decor else take_room(seats))
        self._cameras: dict[str, SeatCamera] = {}
        self._inside = view.eyes if view.kind == "seat" or view.screens else ""
        """Through whose eyes the picture is seen."""
        opened = windows if self._surface.window is not None else None
        self.interaction = opened.interaction(self.painter, looks) if opened is not None else None
        self._from: list[Sight] = []
        self._drawn = 0
        self._eyes = eyes_before(view.screens, view.eye_distance)
        self._cast: dict[str, _Cast] = {}
        self._ghosts = Ghosts()
        self._load = load
        self._loader = ThreadPoolExecutor(1, thread_name_prefix="avatars")
        # Compiling the filter may take seconds the first time: pictures come without it until then.
        self._smoothing = self._loader.submit(antialias, np.zeros((8, 8, 4), np.uint8))
        self.closed_by_user = False
        self.camera: Camera | None = None
        """Where the room is looked at from in place of its overview."""

    def render(self, instant: Instant) -> U8:
        """The picture of an instant, (height, width, 4) RGBA, first row at the bottom."""
        self._meet(instant)
        self._furnishing.meet(instant)
        if self.interaction is not None:
            self.interaction.take(instant, self._from, self.painter.size)
            instant = self.interaction.predicted(instant)
        self.painter.draw(self._frame(instant))
        drawn, shown = self.painter.size, (self.view.width, self.view.height)
        out = np.empty((drawn[1], drawn[0], 4), np.uint8)
        self.painter.read_into(out)
        if (fault := self.painter.error()) in LOST:
            raise RuntimeError(f"OpenGL says {fault}: the graphics card is lost, or out of memory")
        if self._smooths and self._smoothing.done():
            out = antialias(out)
            if self.interaction is not None:
                self.painter.put_back(out)
        out[..., 3] = 255
        if drawn != shown:
            out = np.asarray(cv2.resize(out, shown, interpolation=cv2.INTER_LINEAR), np.uint8)
        if not self.painter.show(partial(self._overlay, instant)):
            self.closed_by_user = True
        return out

    def render_complete(self, instant: Instant) -> U8:
        """The picture of an instant, as `render` gives it, once everybody in it has their own figure and the last filter is
        ready; waits for that."""
        self._smoothing.result()
        picture = self.render(instant)
        while not self.complete:
            wait([cast.coming for cast in self._cast.values() if cast.coming is not None])
            picture = self.render(instant)
        return picture

    def draw_at(self, scale: float) -> None:
        """Draw only `scale` times the width and height from now on; pictures keep their size."""
        if scale == self._scale:
            return
        self._scale = scale
        self._screens = tuple(s.scaled(scale) for s in self.view.screens)
        one = round(scale * self.view.width), round(scale * self.view.height)
        self.painter.resize(*(picture_size(self._screens, self.view.stereo) if self._screens else one))

    def relight(self, light: str) -> None:
        """Draw in this light from now on, on the same surface. What it takes is made the first time and kept from then on, so
        that going to and fro costs nothing."""
        fine = _FINE[light]
        fine = not self.capability.software if fine is None else fine
        if fine == self.painter.fine:
            return
        size = self.painter.size
        self.painter, self._furnishing = self._lights.get(fine) or self._lit(fine, build_room(self._room))
        if self.painter.size != size:
            self.painter.resize(*size)

    def _lit(self, fine: bool | None, room: tuple[list[ShellPanel], Furniture | None]) -> tuple[Painter, ThingsShown]:
        """All that draws in one light. room: what is drawn of it."""
        view = self.view
        painter = Painter(self._surface, view.width, view.height, self._deformer, fine, view.samples)
        painter.set_room(*room)
        detail = 0.6 if self.capability.software else 0.9
        furnishing = ThingsShown(painter, self._looks, detail, (t.id for t in drawn_with_room(self._room)))
        self._lights[painter.fine] = painter, furnishing
        return painter, furnishing

    @property
    def _smooths(self) -> bool:
        """Whether edges are smoothed after drawing."""
        return self.capability.software and not self.painter.fine and self.view.samples is None

    @property
    def complete(self) -> bool:
        """Everybody met so far has their own figure (or will never have), and the picture its final filters."""
        return self._smoothing.done() and not self.stand_ins

    @property
    def stand_ins(self) -> int:
        """How many are drawn as stand-ins because their avatar is not there yet."""
        return sum(cast.waiting for cast in self._cast.values())

    def close(self) -> None:
        """Give everything back."""
        self._loader.shutdown(wait=False, cancel_futures=True)
        try:
            if self.interaction is not None:
                self.interaction.close()
        finally:
            self._surface.close()

    def _overlay(self, instant: Instant) -> None:
        """What is in the window and not in the picture."""
        if self.interaction is not None:
            self.interaction.draw(instant, self._rate.hertz, self._scale)

    def _frame(self, instant: Instant) -> Frame:
        posed = self._pose(instant)
        self._from = self._aim(instant, posed)
        self._drawn += 1
        self._rate.drew(instant.now_ns)
        figures: list[FigureView] = []
        labels: list[LabelView] = []
        for person in instant.people:
            name = person.about.name
            cast, now = self._cast[name], posed[name]
            own = name == self._inside
            limbs = limb_rows(now.posed, cast.shape.casters)
            # Before a wall stands the viewer's own body: only its shadow is drawn.
            shown = not (own and self.view.screens)
            seen = limb_rows(now.posed, below_head(cast.shape.body, cast.shape.casters)) if own else None
            figures.append(FigureView(name, now.model, now.skin, limbs, own, shown, now.folds, seen))
            if self.view.names and not own:
                head = JOINT_INDEX["head"]
                crown = now.joints.position[head] + now.joints.rotation[head] @ cast.shape.skeleton.tip[head]
                breast = now.joints.position[JOINT_INDEX["spine_6"]]
                labels.append(LabelView(self._label(instant, person, cast), crown + np.array((0.0, 0.07, 0.0)), breast))
        outlines, names = self._furnishing.selections(instant)
        said = [
            LabelView(c.over_things, instant.world.poses[t][0] + np.array((0.0, 0.16, 0.0)))
            for c in instant.captions
            for t in c.things
            if t in instant.world.poses
        ]
        if self.interaction is not None:
            outlines = self.interaction.outlines(outlines)
        gauges = rows_of(instant, self._rate.hertz, self._scale) if self._settings.gauges else ()
        gauges = (*gauges, *(self.interaction.rows() if self.interaction is not None else ()))
        named = [*labels, *names, *said]
        read = self._furnishing.fronts(instant)
        return Frame(self._from, figures, self._furnishing.views(instant), named, outlines, instant.captions, gauges, read)

    def _pose(self, instant: Instant) -> dict[str, PosedVertices]:
        """Everybody in the posture of this instant; who touches somebody deforms."""
        shapes = {p.about.name: self._cast[p.about.name].shape for p in instant.people}
        bodies: dict[str, PosedBody] = {}
        joints: dict[str, JointPose] = {}
        if instant.world.ghosts or instant.world.bonds:
            for p in instant.people:
                shape = shapes[p.about.name]
                joints[p.about.name] = pose_joints(shape.skeleton, p.posture)
                bodies[p.about.name] = pose_body(shape.body, joints[p.about.name])
        ghosts = self._ghosts.of(instant, shapes, bodies)
        to_things, to_figures = pulls_of(instant, bodies, joints, shapes)
        for name, held in to_figures.items():
            ghosts.setdefault(name, []).extend(held)
        self._furnishing.reshape(instant, shapes, bodies, to_things)
        return {p.about.name: self._pose_one(instant, p, ghosts.get(p.about.name, ())) for p in instant.people}

    def _looking(self, instant: Instant, person: PersonNow, pixels_per_m: float) -> Posture:
        """The person's posture with both eyes on what they look at: somebody else's face, or a thing; where eyes are seen."""
        posture, skeleton = person.posture, self._cast[person.about.name].shape.skeleton
        if pixels_per_m < EYES_SEEN:
            return posture
        others = [c.head for name, c in self._cast.items() if name != person.about.name and c.head is not None]
        places = [*others, *(position for position, _ in instant.world.poses.values())]
        left, right = (skeleton.rest[JOINT_INDEX[f"{side}_eye"]] for side in ("left", "right"))
        away = distance_looked_at(pose_joints(skeleton, posture), places)
        return converged(posture, float(np.linalg.norm(left - right)), away)

    def _pose_one(self, instant: Instant, person: PersonNow, ghosts: Sequence[GhostSource]) -> PosedVertices:
        name, posture = person.about.name, person.posture
        cast = self._cast[name]
        try:
            # Out of the picture, only their shadow is seen.
            size = self._pixels_per_m(cast.at) if cast.at is None or name in self.painter.seen else 0.0
            now = cast.shape.pose(
                self._looking(instant, person, size),
                ghosts,
                size,
                planned=self._deformer is not None,
                at_ns=instant.now_ns,
                speech=instant.speech.get(name),
            )
            cast.at = now.joints.position[JOINT_INDEX["hips"]]
            cast.head = now.joints.position[JOINT_INDEX["left_eye"]]
            return now
        except Exception:  # one figure that cannot be computed must not take the picture away from everybody
            log.exception("event=figure_failed participant=%s shown=stand-in", name)
            cast.shape, cast.remark = StandIn(cast.about.height, cast.about.proportions), "figure failed"
            return cast.shape.pose(posture)

    def _pixels_per_m(self, hips: F64 | None) -> float:
        """How large a person whose hips were there in the last picture is in it."""
        if hips is None or not self._from:
            return math.inf
        sizes: list[float] = []
        for sight in self._from:
            away = float(np.linalg.norm(sight.camera.position - hips))
            height = sight.box[3] if sight.box else self.painter.size[1]
            sizes.append(sight.camera.pixels_per_m(max(NEAREST, away - ARM), height))
        return max(sizes)

    def _aim(self, instant: Instant, posed: dict[str, PosedVertices]) -> list[Sight]:
        """From where the picture is drawn."""
        view, chosen = self.view, self._settings
        viewer = posed.get(view.eyes)
        if view.screens:
            if viewer is not None:
                sockets = viewer.joints.position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]]
                self._eyes = eyes_apart(sockets, chosen.eye_distance)
            return sights_of_screens(self._screens, self._eyes, view.stereo, self._drawn)
        who = {Mode.SEAT: view.eyes, Mode.FOLLOW: chosen.who}.get(chosen.mode, "")
        seen = posed.get(who)
        self._inside = who if seen is not None else ""
        if seen is not None:
            camera = self._cameras.setdefault(who, SeatCamera()).follow(instant.now_ns, seen.joints)
        else:
            camera = self.camera or overview()
        if self.interaction is not None:
            camera = self.interaction.camera(camera)
        if not view.stereoscopic:
            return [Sight(camera)]
        size = self.painter.size
        return sights_of_desktop(camera, size, view.stereo, self._drawn, chosen.eye_distance, chosen.convergence)

    @property
    def _settings(self) -> Choices:
        """As the view says, or as somebody at the window has set it."""
        return self.interaction.choices if self.interaction is not None else choices_of(self.view)

    def _label(self, instant: Instant, person: PersonNow, cast: _Cast) -> Label:
        if person.timing.age_ns > NO_SIGNAL_NS:
            return Label(person.about.display_name, "no signal", warning=True)
        if cast.remark:
            return Label(person.about.display_name, cast.remark, warning=True)
        if cast.waiting and not cast.about.here:
            return Label(person.about.display_name, "avatar on its way")
        held = [g.thing for g in instant.world.grasps if g.participant == person.about.name]
        names = [instant.things[h].name if h in instant.things else h for h in dict.fromkeys(held)]
        talking = person.about.name in instant.talking
        sign = sign_of(instant.world.signals, person.about.name)
        return Label(person.about.display_name, f"holds {', '.join(names)}" if names else "", talking=talking, sign=sign)

    def _meet(self, instant: Instant) -> None:
        """Give everybody a figure; those whose avatar is not there yet, or cannot be had, a stand-in."""
        expected = [*(person.about for person in instant.people), *instant.coming]
        for about in expected:
            cast = self._cast.get(about.name)
            if cast is None or cast.about != about:
                cast = self._cast[about.name] = self._enter(about, cast)
            if cast.coming is not None and cast.coming.done():
                fault = cast.coming.exception()
                if fault is None:
                    cast.shape = cast.coming.result()
                else:
                    cast.remark = "avatar missing"
                    log.error(
                        "event=avatar_missing participant=%s avatar=%r reason=%r shown=stand-in",
                        about.name,
                        about.avatar,
                        str(fault),
                    )
                cast.coming = None
        present = {about.name for about in expected}
        for name in set(self._cast) - present:
            del self._cast[name]
            for painter, _ in self._lights.values():
                painter.drop_figure(name)

    def _enter(self, about: ParticipantInfo, before: _Cast | None) -> _Cast:
        """Their own figure if it was made ahead, else what was shown of them `before` or a stand-in while it is made."""
        figure = take_figure(about)
        if figure is not None:
            return _Cast(about, self._dressed(figure), None)
        if before and not before.waiting and not before.remark and replace(before.about, here=about.here) == about:
            return replace(before, about=about)
        if before and (before.about.height, before.about.proportions) == (about.height, about.proportions):
            stand_in = before.shape
        else:
            stand_in = StandIn(about.height, about.proportions)
        return _Cast(about, stand_in, self._loader.submit(self._load_ready, about) if about.here else None)

    def _load_ready(self, about: ParticipantInfo) -> DrawableFigure:
        """Their figure, with all it takes to plan its frames."""
        shape = self._dressed(self._load(about))
        if self._deformer is not None:
            for size in (math.inf, *COARSER_BELOW):
                shape.pose(standing(), (), size, planned=True)
        return shape

    def _dressed(self, shape: DrawableFigure) -> DrawableFigure:
        """A figure with muscles and bones under its skin, and with wrinkles, or without them, as the view says."""
        if isinstance(shape, AvatarFigure):
            if not self.view.layers:
                shape.without_layers()
            if not self.view.wrinkles:
                shape.without_wrinkles()
        return shape
