"""The Beacon, an invented optical tracker for up to eight receivers. VISTEL finds it through its entry point.

In a conference file: tracker = { kind = "beacon", port = "/dev/ttyUSB0" }, or without a port for a simulated one.
"""

from beacon.protocol import WHO
from vistel.devices.kind import DeviceKind

KIND = DeviceKind(
    name="beacon",
    role="tracker",
    title="an Example Beacon",
    defaults={"baud": 230400},
    receivers=8,
    question=WHO,
    signatures=(rb"Beacon \d",),
    driver="beacon.driver:connect",
    simulator="beacon.simulator:simulate",
    calibration="tracker",
    doctor="vistel_services.devices.machine:serial_ports",
)
