"""Contacts as forces: area, pressure, normal force, friction and torque of every patch two bodies share (mathematics M7).

The forces on two bodies are opposite and act at the same points: closed systems keep their momentum to rounding.
Pressures are those of the ghosts that deform the bodies, p = (F - T) / c at the shared surface.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.implicit.contacts.contact import find_contacts
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.contact.patch_kernels import (
    ANGLES,
    AREA,
    CENTRE,
    FORCE,
    FRICTION,
    GREATEST,
    MEAN,
    NORMAL,
    NORMAL_FORCE,
    RESULT,
    TORQUE,
    patch,  # pyright: ignore[reportUnknownVariableType]
)

STIFFEST = 0.02
"""Compliance that stands for a rigid body here: pressure needs some give."""


@dataclass(frozen=True)
class ContactParameters:
    """How bodies push and rub. pressure: of one unit of field [Pa]; friction: Coulomb's number; damping [s/m]: of
    Hunt and Crossley; creep: speed under which friction fades [m/s]; viscosity [s/m]: how much more constraints hold
    for each metre per second they are drawn out."""

    pressure: float = 3e4
    friction: float = 0.5
    damping: float = 0.4
    creep: float = 1e-3
    viscosity: float = 0.4


@dataclass(frozen=True)
class Motion:
    """How a body moves: velocity [m/s], spin [rad/s], centre of mass [m], each (3,), room frame."""

    velocity: F64
    spin: F64
    centre: F64

    def flat(self) -> F64:
        """(9,) numbers."""
        return np.concatenate([self.velocity, self.spin, self.centre])


@dataclass(frozen=True)
class ContactPatch:
    """One contact of primitive `a` of a body with primitive `b` of another.

    point: centre of pressure [m]; normal: from a to b; area [m^2]; normal_force [N] along it without damping;
    mean_pressure, peak_pressure [Pa]; force on a [N], of which friction; torque of it on a about the room's origin
    [N m]. On b everything is the opposite.
    """

    a: int
    b: int
    point: F64
    normal: F64
    area: float
    normal_force: float
    mean_pressure: float
    peak_pressure: float
    force: F64
    friction: F64
    torque: F64

    def torque_about(self, centre: F64) -> F64:
        """Torque (3,) of the force on a about a point [N m]."""
        return self.torque - np.cross(centre, self.force)


_STILL = Motion(np.zeros(3), np.zeros(3), np.zeros(3))


def contact_patches(
    a: PrimitiveSet,
    b: PrimitiveSet,
    compliance_a: float = 1.0,
    compliance_b: float = 1.0,
    *,
    motion_a: Motion = _STILL,
    motion_b: Motion = _STILL,
    surface: ContactParameters | None = None,
    angles: int = ANGLES,
) -> list[ContactPatch]:
    """Every patch that two posed bodies share, in order of primitives; empty where they do not overlap.

    surface: how they push and rub; by default of pressure 1 and without friction, so that forces are in field units.
    """
    s = surface if surface is not None else ContactParameters(1.0, 0.0, 0.0)
    found = find_contacts(a, b)
    arrays_a, arrays_b = _arrays(a), _arrays(b)
    whole_a, whole_b = np.array([0, len(a)]), np.array([0, len(b)])
    c_a, c_b = max(compliance_a, STIFFEST), max(compliance_b, STIFFEST)
    moving_a, moving_b = motion_a.flat(), motion_b.flat()
    out: list[ContactPatch] = []
    for k in range(len(found)):
        if not found.field_depth[k] > 0.0:
            continue
        r = np.zeros(RESULT)
        i, j = int(found.a[k]), int(found.b[k])
        patch(
            i,
            j,
            whole_a,
            whole_b,
            c_a,
            c_b,
            arrays_a,
            arrays_b,
            found.point[k],
            found.normal[k],
            _size(a, i, b, j),
            s.pressure,
            s.friction,
            s.damping,
            s.creep,
            moving_a,
            moving_b,
            angles,
            r,
        )
        if r[AREA] > 0.0:
            out.append(
                ContactPatch(
                    i,
                    j,
                    r[CENTRE].copy(),
                    r[NORMAL].copy(),
                    float(r[AREA]),
                    float(r[NORMAL_FORCE]),
                    s.pressure * float(r[MEAN]),
                    s.pressure * float(r[GREATEST]),
                    r[FORCE].copy(),
                    r[FRICTION].copy(),
                    r[TORQUE].copy(),
                )
            )
    return out


def _arrays(s: PrimitiveSet) -> tuple[NDArray[np.int32], NDArray[np.int32], F64, F64, F64]:
    return s.kind, s.start, s.params, s.rotation, s.position


def _size(a: PrimitiveSet, i: int, b: PrimitiveSet, j: int) -> float:
    """A length that both primitives know: the least of their radii [m]."""
    return min(_radius(a, i), _radius(b, j))


def _radius(s: PrimitiveSet, i: int) -> float:
    p = s.params[s.start[i] : s.start[i + 1]]
    kind = int(s.kind[i])
    if kind == 1:
        return float(min(p[6], p[7]))
    return float(p[:3].min() if kind >= 3 else p[0])
