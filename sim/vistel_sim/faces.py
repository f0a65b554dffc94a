"""The simulators of the built-in kinds of phones and cameras that see faces and eyes (`DeviceKind.simulator`)."""

from vistel.conference.device_list import Device
from vistel.conference.devices import EyeConfig
from vistel_sim.phone import SimulatedSender, face_packets, sender, talking
from vistel_sim.pictures.camera import Scene, SimulatedCamera
from vistel_sim.pictures.faces import EyeScene, FaceScene
from vistel_sim.simulation import Simulation


def live_link(device: Device, simulation: Simulation) -> SimulatedSender:
    """A phone that sees somebody talk."""
    return sender(device.name, face_packets(device.name, talking), simulation)


def face_camera(device: Device, simulation: Simulation) -> SimulatedCamera:
    """A camera that sees somebody talk."""
    return _camera(FaceScene(talking, simulation.seed(device.name)), device, simulation)


def eye_camera(device: Device, simulation: Simulation) -> SimulatedCamera:
    """A camera that sees the eye of a participant, who looks where the motion says."""
    assert device.participant is not None
    name, motion, right = device.participant.name, simulation.motion, device.config_as(EyeConfig).eye == "right"
    scene = EyeScene(lambda t_s: motion.posture(name, t_s).gaze, talking, simulation.seed(device.name), right=right)
    return _camera(scene, device, simulation)


def _camera(scene: Scene, device: Device, simulation: Simulation) -> SimulatedCamera:
    link, clock, seed = simulation.link(device.name), simulation.clock, simulation.seed(device.name)
    return SimulatedCamera(device.name, scene, link, clock, simulation.start_ns, simulation.faults, seed=seed)
