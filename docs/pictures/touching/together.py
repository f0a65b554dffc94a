"""Draws together.png: hands on a cup and a ball, and something sticky that is pulled off the table.

    python -m docs.pictures.touching.together [--out FILE]

Everything goes through the world: hands come, close and move, and are drawn as the world says that they hold. Needs an OpenGL
context (software is fine).
"""

import argparse
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from docs.pictures.drawing.implicit_render import label
from docs.pictures.drawing.mesh_render import Part, Studio
from docs.pictures.touching.figures_touching import dressed
from vistel.arrays import F64
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.figure import Figure
from vistel.figure.grip import closed_round
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.hands import OPEN, hand_rotation
from vistel.figure.posture.posture import WRIST, Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rotation_x, rotvec_from_matrix
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.implicit.ghosts.mesh_ghosts import pulled
from vistel.messages.world.encode import bond_message, thing_message
from vistel.render.stage.hand_correction import ShownPerson, hand_offset, moved_hand
from vistel.render.things.soft import SoftThing, bond_pulls
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.memory.bonds import Bond
from vistel.space.memory.dents import imprints
from vistel.space.people import HAND_JOINT, build_like
from vistel.space.room import TABLE_HEIGHT, Extra, meeting_room
from vistel.space.things.tessellate import tessellate_thing
from vistel.space.things.things import PhysicsMaterial, Thing, ThingPrimitive
from vistel.space.view import WorldView
from vistel.space.world import World

STEP_NS, SIZE = 16_666_667, (330, 300)
AVATAR = builtin_avatar("builtin:person=erik", name="together", height=1.75)
LIKE = Proportions.of(AVATAR.skeleton, AVATAR.body)
BUILD = build_like(LIKE)
FIST = closed_round(AVATAR.skeleton, AVATAR.body, "right", BUILD.palm[1] - np.array([0.0, 0.012, 0.0]), 0.012)
DRAWN = 0.012
"""How far the sticky thing is drawn off the table [m]."""


def hand_at(palm: F64, heading: float, closing: float) -> Posture:
    """Somebody whose right palm is at `palm` [m, room] and faces down; closing: 0 open to 1."""
    dofs = standing().dofs.copy()
    pose = pose_joints(AVATAR.skeleton, Posture(dofs, stance=Stance(np.zeros(3), heading)))
    wanted = hand_rotation(-1.0, np.array([math.sin(heading), 0.0, math.cos(heading)]), np.array([0.0, -1.0, 0.0]))
    forearm = pose.rotation[JOINT_INDEX["right_lower_arm"]]
    dofs[WRIST["right"]] = rotvec_from_matrix(np.ascontiguousarray(forearm.T @ wanted))
    hands = np.stack([OPEN, OPEN + closing * (FIST - OPEN)])
    pose = pose_joints(AVATAR.skeleton, Posture(dofs, hands, Stance(np.zeros(3), heading)))
    j = HAND_JOINT[1]
    return Posture(dofs, hands, Stance(palm - pose.position[j] - pose.rotation[j] @ BUILD.palm[1], heading))


class Scene:
    """A world and its people, from step to step."""

    def __init__(self, *extras: Extra, own: tuple[Thing, ...] = ()) -> None:
        room = meeting_room(2, extras)
        self.world, self.k = World(replace(room, things=(*room.things, *own))), 0
        self.postures: dict[str, Posture] = {}

    def step(self, **postures: Posture) -> WorldView:
        self.k += 1
        people = tuple(ParticipantBody(n, proportions=LIKE) for n in postures if n not in self.postures)
        self.postures |= postures
        motions = tuple(MotionInput(n, p, self.k, self.k * STEP_NS) for n, p in sorted(self.postures.items()))
        return self.world.step(StepInputs(self.k, self.k * STEP_NS, people, motions))

    def take(self, thing: str, top: float, lift: float) -> WorldView:
        """ann takes it from above and lifts it."""
        place = self.world.room.by_id[thing].position + np.array([0.0, top, 0.0])
        for k in range(70):
            self.step(ann=hand_at(place + np.array([0.0, 0.1 * max(0.0, 1.0 - k / 20), 0.0]), 0.0, min(1.0, max(0.0, k - 22) / 30)))
        for k in range(25):
            view = self.step(ann=hand_at(place + np.array([0.0, lift * (k + 1) / 25, 0.0]), 0.0, 1.0))
        return view

    def drawn(self, view: WorldView, who: str) -> Posture:
        """The posture of somebody as a renderer shows it: the hand on what it holds."""
        own = self.postures[who]
        grasp = next((g for g in view.grasps if g.participant == who), None)
        if grasp is None:
            return own
        thing = next(s for s in view.states if s.id == grasp.thing)
        joints = pose_joints(AVATAR.skeleton, own)
        off = hand_offset(joints, True, Pose(thing.position, thing.rotation), Pose(grasp.seen_position, grasp.seen_rotation))
        posture = replace(own, hands=np.stack([own.hands[0], grasp.fingers]))
        return moved_hand(ShownPerson(own, joints, AVATAR.skeleton), posture, True, 1.0, off)


def people(scene: Scene, view: WorldView, names: tuple[str, ...] = ("ann",)) -> list[Part]:
    figure = Figure(AVATAR)
    return [part for n in names for part in dressed(figure, figure.pose(scene.drawn(view, n)))]


def solid(thing: Thing, view: WorldView) -> list[Part]:
    at = next(s for s in view.states if s.id == thing.id)
    colour = tuple(((thing.colour >> s) & 255) / 255 for s in (24, 16, 8))
    moved = [s.moved(at.position, at.rotation) for s in tessellate_thing(thing)]
    return [Part.plain(s.vertices, s.triangles, colour) for s in moved]


def table(scene: Scene, view: WorldView) -> list[Part]:
    return solid(replace(scene.world.room.thing("table"), colour=0xBD946BFF), view)


def cup() -> Thing:
    upright = quaternion_from_matrix(rotation_x(-0.5 * math.pi))
    body = ThingPrimitive("superellipsoid", (0.031, 0.031, 0.045, 0.25, 1.0), rotation=upright)
    handle = ThingPrimitive("supertoroid", (0.006, 0.006, 0.006, 3.2, 1.0, 1.0), np.array([0.042, 0.0, 0.0]))
    return Thing("cup", "cup", "cup", (body, handle), 0.2, 0.0, 0x4F7FB5FF, np.array([-0.25, TABLE_HEIGHT + 0.0455, 0.2]))


def held(thing: str, top: float) -> tuple[list[Part], F64]:
    scene = Scene(own=(cup(),))
    view = scene.take(thing, top, 0.12)
    seen = next(t for t in view.things if t.id == thing)
    at = next(s.position for s in view.states if s.id == thing)
    return [*people(scene, view), *solid(seen, view), *table(scene, view)], at


def stretched() -> tuple[list[Part], F64]:
    """A soft sticky lump, half way off the table."""
    lump = Extra("lump", "lump", "ball", 0.032, 0.1, 0.2, 0xD6B25EFF, -0.2, 0.2, PhysicsMaterial(sticky=0.022, bears=6.0))
    scene = Scene(lump)
    view = scene.take("lump", 0.034, 0.0)
    place = scene.world.room.thing("lump").position + np.array([0.0, 0.034, 0.0])
    bonds: tuple[Bond, ...] = ()
    for k in range(80):
        new = scene.step(ann=hand_at(place + np.array([0.0, 0.0008 * k, 0.0]), 0.0, 1.0))
        high = next(x.position[1] for x in new.states if x.id == "lump") - scene.world.room.thing("lump").position[1]
        if high > DRAWN or any(t.body == "table" for t in new.torn):
            break
        view, bonds = new, tuple(b for b in new.bonds if b.body == "table" and not b.torn_ns)
    thing = next(t for t in view.things if t.id == "lump")
    state = next(s for s in view.states if s.id == "lump")
    pose = state.position, state.rotation
    desk, message = scene.world.room.thing("table"), thing_message(thing)
    soft = SoftThing(thing)
    pulls = []
    for b in bonds:
        p = desk.primitives[b.primitive]
        turn = matrix_from_quaternion(desk.rotation)
        rotation = quaternion_from_matrix(turn @ matrix_from_quaternion(p.rotation))
        limb, at = (
            ThingPrimitive(p.kind, p.params, desk.position + turn @ p.position, rotation),
            desk.position + turn @ b.point_body,
        )
        both = bond_pulls(bond_message(b), thing, pose, limb, at, view.t_ns)
        pulls += [(limb, x) for x in both if x.target == "thing"]
    return [*people(scene, view), *table(scene, view), _soft(soft, pulls, pose, view, message.colour)], state.position


def _soft(soft: SoftThing, pulls: list, pose: tuple[F64, F64], view: WorldView, colour: int) -> Part:
    shape = soft.reshape([], [pulled(ghosts_of(imprints([limb])), [pull]) for limb, pull in pulls], pose, view.t_ns)
    rgb = tuple(((colour >> s) & 255) / 255 for s in (24, 16, 8))
    surface = soft.surface
    vertices = surface.vertices if shape is None else shape.positions
    if shape is None or not shape.in_room:
        vertices = vertices @ matrix_from_quaternion(pose[1]).T + pose[0]
    return Part.plain(vertices, surface.triangles, rgb)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "together.png")
    arguments = parser.parse_args()
    studio, pictures = Studio(), []
    for text, (parts, at), eye, angle in (
        ("a cup", held("cup", 0.047), (-0.24, 0.10, 0.34), 0.5),
        ("a ball", held("ball", 0.040), (-0.24, 0.04, 0.34), 0.5),
        ("pulled off the table", stretched(), (-0.26, -0.01, 0.26), 0.36),
    ):
        picture = studio.photograph(parts, tuple(at + np.array(eye)), tuple(at), SIZE, angle)
        pictures.append(label(picture, text))
    out = Image.new("RGB", (SIZE[0] * len(pictures), pictures[0].height), "white")
    for i, picture in enumerate(pictures):
        out.paste(picture, (i * SIZE[0], 0))
    out.save(arguments.out, optimize=True)


if __name__ == "__main__":
    main()
