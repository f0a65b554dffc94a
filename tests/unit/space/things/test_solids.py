"""Things as arrays: bounds, contact points, inertia, posing."""

import numpy as np
import pytest

from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.contacts.contact import find_contacts
from vistel.implicit.contacts.contact_kernels import surface
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.dynamics.solids import Solids, pose_solids, solids
from vistel.space.room import meeting_room
from vistel.space.things.things import Thing, ThingPrimitive


def seen(s: Solids, k: int, point: np.ndarray) -> np.ndarray:
    """Distance, normal and ratio of primitive k from a point of the thing's frame."""
    p, out = s.primitives, np.empty(5)
    surface(*(p.rotation[k].T @ (point - p.position[k])), p.kind[k], p.params[p.start[k] : p.start[k + 1]], out)
    return out


@pytest.mark.parametrize("name", [t.id for t in meeting_room(3).things])
def test_probes_reach_the_surface_and_lie_within_the_bounds(name: str) -> None:
    s = solids((meeting_room(3).thing(name),))
    for contact_point, radius in zip(s.contact_point, s.contact_point_radius, strict=True):
        distances = [seen(s, k, contact_point)[0] for k in range(len(s.owner))]
        assert min(distances) + radius < 1e-6, "a contact point stands off the surface"
        assert np.linalg.norm(contact_point) + radius <= s.radius[0] + 1e-9


def test_flat_faces_have_probes_flush_with_them() -> None:
    s = solids((meeting_room(3).thing("box"),))
    below = s.contact_point[s.contact_point[:, 1] < -0.0295]
    assert len(below) >= 4
    assert np.ptp(below[:, 0]) > 0.05
    assert np.ptp(below[:, 2]) > 0.035


def test_inertia_of_a_ball() -> None:
    ball = Thing("b", "b", "b", (ThingPrimitive("sphere", (0.1,)),), 2.0, 0.0, 0, np.zeros(3))
    np.testing.assert_allclose(np.diag(np.linalg.inv(solids((ball,)).inverse_inertia[0])), 0.4 * 2.0 * 0.01, rtol=0.06)


def test_fixed_things_cannot_be_moved() -> None:
    s = solids((meeting_room(3).thing("table"),))
    assert s.inverse_mass[0] == 0.0
    assert not s.inverse_inertia.any()


def test_posing_turns_and_moves_every_primitive() -> None:
    s = solids(meeting_room(3).things[:2])
    q = np.array([0.1, 0.7, -0.2, 0.5])
    r = matrix_from_quaternion(q)
    posed = pose_solids(s, np.array([np.eye(3), r]), np.array([[0.0, 0, 0], [1.0, 2, 3]]))
    mine = s.owner == 1
    np.testing.assert_allclose(posed.position[mine], s.primitives.position[mine] @ r.T + (1.0, 2.0, 3.0))
    np.testing.assert_allclose(posed.rotation[mine], r @ s.primitives.rotation[mine])
    np.testing.assert_array_equal(posed.position[~mine], s.primitives.position[~mine])


def test_the_table_top_is_flat_to_a_finger_on_it() -> None:
    s = solids((meeting_room(3).thing("table"),))
    top = pose_solids(s, np.eye(3)[None], np.zeros((1, 3)))
    for x in (0.0, 0.1, 0.2, 0.3, 0.4):
        finger = PrimitiveSet.of_cone_spheres(
            np.array([[x, 0.725, 0.0]]), np.array([[x, 0.725, 0.02]]), np.array([0.008]), np.array([0.008])
        )
        found = find_contacts(finger, top)
        assert found.depth[0] == pytest.approx(0.003, abs=2e-4)
        np.testing.assert_allclose(found.normal[0], (0, -1, 0), atol=1e-2)
