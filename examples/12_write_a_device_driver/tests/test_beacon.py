"""The Beacon's protocol and decoder against its simulator, at a real port (docs/how-to/test-your-integration.md of VISTEL)."""

import numpy as np
import pytest
import serial
from beacon.driver import BeaconDecoder
from beacon.protocol import ANSWER, START, STOP, WHO, Parser

from vistel_sim.testing.waiting import wait_until


@pytest.fixture
def beacon(simulated_tracker):
    """A simulated Beacon on somebody who moves."""
    return simulated_tracker("beacon")


def opened(unit):
    return serial.Serial(str(unit.path), 230400, timeout=30.0)


def test_it_says_who_it_is(beacon):
    with opened(beacon) as line:
        line.write(WHO)
        assert line.read(len(ANSWER)) == ANSWER


def test_frames_are_where_the_receivers_are(beacon):
    decoder, frames = BeaconDecoder("tracker"), []
    with opened(beacon) as line:
        line.write(START)
        while len(frames) < 40:
            frames += decoder.feed(line.read(60), 1)
        truth = beacon.truth(beacon.now_s())
    assert decoder.bytes_skipped == 0
    for receiver in frames[-1].receivers:
        at = receiver.position
        assert np.linalg.norm(truth[receiver.station][0] - (at.x, at.y, at.z)) < 0.3  # people move while lines are read


def test_it_is_silent_before_it_is_started_and_after_it_is_stopped(beacon):
    with opened(beacon) as line:
        line.timeout = 0.3
        assert line.read(1) == b""
        line.write(START)
        line.timeout = 30.0
        assert line.read(60)
        line.write(STOP)
        line.timeout = 0.3
        wait_until(lambda: line.read(4096) == b"", "silence", within_s=60.0)


@pytest.mark.parametrize("fault", ["garbled", "cut"])
def test_what_is_damaged_is_skipped_and_reading_goes_on(beacon, fault):
    parser, samples = Parser(), []
    with opened(beacon) as line:
        line.write(START)
        with getattr(beacon, fault)():
            while parser.bytes_skipped == 0:
                parser.feed(line.read(60))
        while len(samples) < 8:
            samples += parser.feed(line.read(60))


def test_it_can_be_opened_again_after_it_was_unplugged(beacon):
    with opened(beacon) as line, beacon.unplugged(), pytest.raises(serial.SerialException):
        while True:
            line.read(60)
    test_it_says_who_it_is(beacon)
