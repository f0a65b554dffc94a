"""A program that reads a FASTRAK, and its test against a simulated one."""

import pytest
import serial

from vistel.protocol import fastrak, polhemus


def read_poses(port: str, count: int) -> dict[int, tuple[float, float, float]]:
    """The program: positions [m] by station, from the last of `count` records."""
    stations = (1, 2, 3, 4)
    settings = [fastrak.output_list(n) + polhemus.hemisphere(n, (0.0, 0.0, -1.0)) for n in stations]
    parser, poses = fastrak.FastrakParser(), {}
    with serial.Serial(port, 115200, timeout=10.0) as line:
        line.write(b"".join(settings) + fastrak.CENTIMETRES + fastrak.BINARY + b"C")
        while count > 0:
            if not (data := line.read(33)):
                raise TimeoutError(f"{port}: no record for ten seconds")
            records = parser.feed(data, 0)
            poses |= {r.station: r.position for r in records}
            count -= len(records)
    return poses


def test_positions_are_where_the_receivers_are(simulated_fastrak):
    poses = read_poses(str(simulated_fastrak.path), 8)
    truth = simulated_fastrak.truth(simulated_fastrak.now_s())
    for station in (1, 2, 3, 4):
        assert poses[station] == pytest.approx(truth[station][0], abs=0.10)  # people move while records are read


def test_an_unplugged_tracker_is_reported(simulated_fastrak):
    with simulated_fastrak.unplugged(), pytest.raises(serial.SerialException, match="person-tracker"):
        read_poses(str(simulated_fastrak.path), 8)
    assert read_poses(str(simulated_fastrak.path), 8)
