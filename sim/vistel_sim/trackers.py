"""The simulators of the built-in kinds of trackers (`DeviceKind.simulator`)."""

from vistel.arrays import F64
from vistel.conference.device_list import Device
from vistel.conference.devices import AnyTracker, PropTracker
from vistel.figure.posture.posture import pose_joints
from vistel.protocol.vrpn import SIMULATED
from vistel.space.room import meeting_room
from vistel_sim import suite
from vistel_sim.device import SimulatedDevice
from vistel_sim.fastrak import Fastrak, PoseSource
from vistel_sim.liberty import Liberty, Model
from vistel_sim.motion.source import prop_transmitter, receiver_on_prop, simulated_people
from vistel_sim.phone import SimulatedSender, sender
from vistel_sim.simulation import RESTART_S, Simulation
from vistel_sim.vrpn_server import SimulatedVrpn, Tracker


def fastrak(device: Device, simulation: Simulation) -> SimulatedDevice:
    receivers, seed = sorted(device.stations.values()), simulation.seed(device.name)
    unit = Fastrak(poses_of(device, simulation), receivers=receivers, seed=seed, restart_s=RESTART_S)
    return simulation.at_port(device.name, unit, device.config_as(AnyTracker).baud)


def liberty(device: Device, simulation: Simulation) -> SimulatedDevice:
    return _liberty("liberty", device, simulation)


def patriot(device: Device, simulation: Simulation) -> SimulatedDevice:
    return _liberty("patriot", device, simulation)


def _liberty(model: Model, device: Device, simulation: Simulation) -> SimulatedDevice:
    keys, seed = device.config_as(AnyTracker), simulation.seed(device.name)
    receivers, poses = sorted(device.stations.values()), poses_of(device, simulation)
    unit = Liberty(poses, model=model, receivers=receivers, seed=seed, restart_s=RESTART_S, baud=keys.baud)
    return simulation.at_port(device.name, unit, keys.baud)


def vrpn(device: Device, simulation: Simulation) -> SimulatedVrpn:
    """A VRPN server with a tracker."""
    seed = simulation.seed(device.name)
    unit = Tracker(poses_of(device, simulation), sorted(device.stations.values()), seed=seed)
    link, clock = simulation.link(device.name), simulation.clock
    return SimulatedVrpn(device.name, SIMULATED, unit, link, clock, simulation.start_ns, simulation.faults, seed=seed)


def vmc(device: Device, simulation: Simulation) -> SimulatedSender:
    """A suite that sends the participant's body."""
    assert device.participant is not None
    person = simulated_people(simulation.conference, simulation.limbs)[device.participant.name]

    def packet(frame: int, t_s: float) -> bytes:
        return suite.packet(pose_joints(person.skeleton, simulation.motion.posture(person.name, t_s)), person.transmitter)

    return sender(device.name, packet, simulation)


def poses_of(device: Device, simulation: Simulation) -> PoseSource:
    """What the receivers of a unit measure, by the unit's own station numbers."""
    if isinstance(device.config, PropTracker):
        return _poses_of_prop(device, device.config, simulation)
    assert device.participant is not None
    name, motion = device.participant.name, simulation.motion
    roles = {station: role for role, station in device.stations.items()}
    return lambda station, t_s: motion.receivers(name, t_s)[roles[station]]


def _poses_of_prop(device: Device, tracker: PropTracker, simulation: Simulation) -> PoseSource:
    assert device.prop is not None
    conference, prop, motion = simulation.conference, device.prop, simulation.motion
    site = next(s for s in conference.sites if prop in s.props)
    transmitter = prop_transmitter(conference, site, tracker)
    still = {t.id: (t.position, t.rotation) for t in meeting_room(conference.room.seats).things}

    def pose(station: int, t_s: float) -> tuple[F64, F64]:
        at = motion.things(t_s).get(prop.thing) or still[prop.thing]
        return receiver_on_prop(transmitter, tracker, at)

    return pose
