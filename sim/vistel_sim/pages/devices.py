"""The simulators of a guest's page, of its camera and of its headset (`DeviceKind.simulator`): somebody enters, looks round and
waves now and then; camera and headset see them do what simulated devices feel."""

import math
from collections.abc import Callable

from vistel.conference.device_list import Device
from vistel.conference.files import public_avatar
from vistel.conference.seats import seat_place
from vistel.figure.posture.posture import JointPose, pose_joints
from vistel.figure.skeleton import Skeleton, standard_skeleton
from vistel.geometry.rotation import rotation_y
from vistel.protocol.pages.camera_body import camera_record
from vistel.protocol.pages.pointer import guest_record, posture_record
from vistel.v1.device_pb2 import PointerFrame
from vistel_sim.pages.camera_body import SimulatedCamera
from vistel_sim.pages.headset import SimulatedHeadset
from vistel_sim.phone import SimulatedSender, sender
from vistel_sim.simulation import Simulation

WAVES_EVERY_S = 9.0
"""From one wave to the next [s]."""
WHO_EVERY = 15
"""Of so many packets one says who the guest is, as the gateway does."""

NOISE = 0.002
"""Of landmarks [picture heights]: a pixel of 480."""
DEPTH_NOISE_M = 0.04
"""Of their depths [m]."""

NOISE_M = 0.0005
"""Of what a headset measures [m]."""


def page(device: Device, simulation: Simulation) -> SimulatedSender:
    """A page with a guest at it."""
    who = device.participant
    assert who is not None

    def packet(frame: int, t_s: float) -> bytes:
        if frame % WHO_EVERY == 0:
            return guest_record(who.display_name or who.name, public_avatar(who.avatar))
        yaw, number = 0.5 * math.sin(0.4 * t_s), int(t_s / WAVES_EVERY_S)
        return posture_record(yaw, -0.15, gesture=PointerFrame.GESTURE_WAVE if number else 0, number=number)

    return sender(device.name, packet, simulation)


def camera(device: Device, simulation: Simulation) -> SimulatedSender:
    """The camera of such a page."""
    sees = SimulatedCamera(noise=NOISE, depth_noise=DEPTH_NOISE_M, seed=simulation.seed(device.name))
    return _sees(device, simulation, lambda t_ns, skeleton, joints: camera_record(t_ns, sees.see(skeleton, joints)))


def headset(device: Device, simulation: Simulation) -> SimulatedSender:
    """The headset of such a page."""
    return _sees(device, simulation, SimulatedHeadset(noise=NOISE_M, seed=simulation.seed(device.name)).record)


def _sees(device: Device, simulation: Simulation, record: Callable[[int, Skeleton, JointPose], bytes]) -> SimulatedSender:
    """record: what is sent at a time [ns] of the joints of a skeleton, in the seat's frame."""
    who = device.participant
    assert who is not None
    conference = simulation.conference
    position, heading = seat_place(conference.room, conference.seat_of(who.name))
    skeleton, facing = standard_skeleton(who.height), rotation_y(heading)

    def packet(_: int, t_s: float) -> bytes:
        joints = pose_joints(skeleton, simulation.motion.posture(who.name, t_s))
        in_seat = JointPose(facing.T @ joints.rotation, (joints.position - position) @ facing)
        return record(simulation.clock.now_ns(), skeleton, in_seat)

    return sender(device.name, packet, simulation)
