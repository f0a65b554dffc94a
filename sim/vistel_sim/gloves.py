"""The simulators of the built-in kinds of gloves (`DeviceKind.simulator`)."""

from collections.abc import Callable, Sequence

from vistel.conference.device_list import Device
from vistel.conference.devices import GloveConfig
from vistel.protocol.vrpn import SIMULATED_GLOVE
from vistel_sim import vrpn_server
from vistel_sim.cyberglove import CyberGlove
from vistel_sim.device import SimulatedDevice
from vistel_sim.fivedt import Glove5, Glove16, Ultra, UltraReports
from vistel_sim.simulation import RESTART_S, Simulation
from vistel_sim.vrpn_server import PinchGlove, SimulatedVrpn


def cyberglove(device: Device, simulation: Simulation) -> SimulatedDevice:
    keys, seed = device.config_as(GloveConfig), simulation.seed(device.name)
    angles = angles_of(device, simulation)
    unit = CyberGlove(angles, sensors=keys.sensors, right=device.right, seed=seed, restart_s=RESTART_S)
    return simulation.at_port(device.name, unit, keys.baud)


def fivedt_ultra(device: Device, simulation: Simulation) -> SimulatedDevice:
    """A 5DT Data Glove Ultra on a serial port."""
    return _fivedt(Ultra, device, simulation)


def fivedt_16(device: Device, simulation: Simulation) -> SimulatedDevice:
    return _fivedt(Glove16, device, simulation)


def fivedt_5(device: Device, simulation: Simulation) -> SimulatedDevice:
    return _fivedt(Glove5, device, simulation)


def vrpn(device: Device, simulation: Simulation) -> SimulatedVrpn:
    """A VRPN server with a 5DT glove."""
    sensors, seed = device.config_as(GloveConfig).sensors, simulation.seed(device.name)
    unit = UltraReports(angles_of(device, simulation), sensors=sensors, right=device.right, seed=seed)
    return _served(vrpn_server.Glove(unit), device, simulation)


def vrpn_pinch(device: Device, simulation: Simulation) -> SimulatedVrpn:
    """A VRPN server with pinch gloves."""
    return _served(PinchGlove(angles_of(device, simulation), right=device.right), device, simulation)


def angles_of(device: Device, simulation: Simulation) -> Callable[[float], Sequence[float]]:
    """t [s] -> the 20 angles [rad] of the hand that wears a glove."""
    assert device.participant is not None
    name, row, motion = device.participant.name, int(device.right), simulation.motion
    return lambda t_s: motion.hand_angles(name, t_s)[row].tolist()


def _fivedt(kind: type[Ultra | Glove16 | Glove5], device: Device, simulation: Simulation) -> SimulatedDevice:
    keys, seed = device.config_as(GloveConfig), simulation.seed(device.name)
    unit = kind(angles_of(device, simulation), sensors=keys.sensors, right=device.right, seed=seed)
    return simulation.at_port(device.name, unit, keys.baud)


def _served(unit: vrpn_server.ServedDevice, device: Device, simulation: Simulation) -> SimulatedVrpn:
    link, clock, seed = simulation.link(device.name), simulation.clock, simulation.seed(device.name)
    return SimulatedVrpn(device.name, SIMULATED_GLOVE, unit, link, clock, simulation.start_ns, simulation.faults, seed=seed)
