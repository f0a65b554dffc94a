"""Any bytes at all where a camera's JPEGs should be: no picture, or one in which something is seen; never an exception."""

from __future__ import annotations

import math
import os

import cv2
import numpy as np
import pytest

from vistel.conference.device_list import Device
from vistel.conference.devices import EyeConfig, FaceConfig
from vistel_services.devices.service import connect
from vistel_sim.pictures.eye import EyePicture
from vistel_sim.pictures.face import FacePicture, rest_face

CASES = int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "1200"))
NS = 16_666_667


def packets() -> list[bytes]:
    """Small pictures as cameras, and other programs, send them."""
    marks = cv2.resize(FacePicture(3).draw(rest_face(), 0), (96, 72), interpolation=cv2.INTER_AREA)
    eye = cv2.resize(EyePicture(3).draw(np.zeros(2), 1.0, 0), (96, 72), interpolation=cv2.INTER_AREA)
    alpha = np.dstack((marks, marks[..., :1]))
    pictures = ((".jpg", marks), (".jpg", eye), (".png", marks), (".png", alpha), (".png", eye.astype(np.uint16) * 200))
    return [cv2.imencode(kind, picture)[1].tobytes() for kind, picture in pictures]


@pytest.mark.parametrize(
    ("sight", "cases"),
    # An eye is looked for in the whole of every picture: slow.
    [(FaceConfig.model_validate({"kind": "camera"}), CASES), (EyeConfig.model_validate({}), CASES // 10)],
)
def test_fuzz_pictures_give_nothing_or_finite_marks_gaze_and_lids(sight: FaceConfig | EyeConfig, cases: int) -> None:
    decoder = connect(Device("who-camera", sight)).driver.decoder
    rng = np.random.default_rng(5)
    known = packets()
    seen = 0
    for k in range(cases):
        data = bytearray(known[k % len(known)])
        for place in rng.integers(len(data), size=int(rng.integers(4))):
            data[place] = rng.integers(256)
        whole = bytes(data[: rng.integers(len(data) + 1)] if k % 4 == 0 else data)
        before = decoder.bytes_skipped
        frames = decoder.feed(whole, k * NS)
        seen += decoder.bytes_skipped == before
        for frame in frames:
            numbers = [*frame.marks, *frame.gaze, *frame.lids]
            assert numbers and all(math.isfinite(n) for n in numbers)
    assert 0.2 * cases < seen < cases
