"""Peaks between two motions reach the next one."""

from __future__ import annotations

import numpy as np

from vistel.capture.face import FaceCapture
from vistel.capture.peaks import PeakHold
from vistel.v1.device_pb2 import FaceFrame


def test_a_peak_between_two_motions_is_published_and_the_newest_follows() -> None:
    hold = PeakHold(0.1)
    said: list[float] = []
    for values in ([1.0], [1.0, 0.0, 0.9], [0.95], [0.9, 1.6, 1.0]):
        for value in values:
            hold.add(np.array([value]))
        said.append(float(hold.take()[0]))
    assert said == [1.0, 0.0, 0.95, 1.6]
    assert hold.take()[0] == 1.0


def test_noise_and_steady_movement_are_no_peaks() -> None:
    hold = PeakHold(0.1)
    for k in range(30):
        hold.add(np.array([0.2 * k]))
        hold.add(np.array([0.2 * k + 0.1]))
        assert hold.take()[0] == 0.2 * k + 0.1
    for k in range(30):
        hold.add(np.array([10.0 + 0.05 * (k % 2)]))
        hold.add(np.array([10.0]))
        assert hold.take()[0] == 10.0


def test_a_blink_shorter_than_a_motion_is_sent() -> None:
    face = FaceCapture()

    def see(t_ms: int, opening: float) -> None:
        frame = FaceFrame(lids=[opening, opening])
        frame.header.t_ns = t_ms * 1_000_000
        face.take(frame)

    see(1000, 1.0)
    assert face.for_motion()[2] is not None
    for t_ms, opening in ((1004, 0.9), (1008, 0.05), (1012, 1.0)):
        see(t_ms, opening)
    lids = face.for_motion()[2]
    assert lids is not None and lids[0] < 0.1
    lids = face.for_motion()[2]
    assert lids is not None and lids[0] == 1.0
