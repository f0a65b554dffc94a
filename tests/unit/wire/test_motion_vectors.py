"""Frames of version 1 and what they mean, committed: they decode so for ever, here and by the page alone.

`python tests/unit/wire/test_motion_vectors.py` writes them; only a new version of the model needs new ones.
"""

from __future__ import annotations

import json
import math
from base64 import b64decode, b64encode
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plain_motion_decoder import Field, PlainDecoder

from vistel.v1.motion_pb2 import Motion
from vistel.wire.motion import MOTION_FIELDS, MotionDecoder, MotionEncoder, MotionFrame, MotionSample, StalePart
from vistel.wire.motion_codec.layout import NUMBERS, PLACES, scale

VECTORS = Path(__file__).with_name("motion_vectors.json")
FRAME_NS = 16_666_667


def moving(seed: int, count: int, whole: bool) -> list[MotionSample]:
    """Sines, with a face and legs where `whole`; gaps in the numbering, and a sensor that falls silent."""
    rng = np.random.default_rng(seed)
    size, speed, phase = rng.exponential(0.2, NUMBERS), rng.uniform(0.2, 6.0, NUMBERS), rng.uniform(0.0, 6.0, NUMBERS)
    size[PLACES["face"]] *= 0.03
    out: list[MotionSample] = []
    for i in range(count):
        seq = i + 1 + (i > count // 2) * 3
        row = size * np.sin(speed * i / 60.0 + phase)
        part = {name: row[place] for name, place in PLACES.items()}
        sample = MotionSample(
            seq,
            10**18 + seq * FRAME_NS,
            part["body"],
            part["hands"].reshape(2, 20),
            part["stance"],
            stale=StalePart.LEFT_GLOVE if i % 7 > 4 else StalePart(0),
        )
        more = ("gaze", "face", "lids", "legs", "collars", "jaw")
        out.append(replace(sample, **{name: part[name] for name in more}) if whole else sample)
    return out


def cases() -> dict[str, list[Motion]]:
    """What the encoder makes today. The file also has frames of earlier encoders, which are only decoded."""
    streams = {
        "rare losses, a body and hands": (MotionEncoder(), moving(1, 40, False)),
        "some losses, everything": (MotionEncoder(losses="some"), moving(2, 30, True)),
        "many losses, everything": (MotionEncoder(losses="many"), moving(5, 12, True)),
        "coarser and many losses": (MotionEncoder(grain=5, losses="many"), moving(3, 12, True)),
        "finer and rare losses": (MotionEncoder(grain=0), moving(4, 12, False)),
    }
    return {name: [encoder.encode(s) for s in samples] for name, (encoder, samples) in streams.items()}


def plain_decoder() -> PlainDecoder:
    model = json.loads((files("vistel.wire.motion_codec") / "model_v1.json").read_text("ascii"))
    return PlainDecoder([Field(f.part, f.count, f.low, f.high, f.step, f.group) for f in MOTION_FIELDS], model)


def stored() -> dict[str, list[dict[str, Any]]]:
    return json.loads(VECTORS.read_text("ascii"))


@pytest.mark.parametrize("name", stored())
def test_stored_frames_mean_what_they_meant(name: str) -> None:
    decoder, plain = MotionDecoder(), plain_decoder()
    for row in stored()[name]:
        message = Motion(frame=b64decode(row["frame"]))
        message.header.seq, message.header.t_ns = row["seq"], row["t_ns"]
        frame = decoder.open(message)
        assert isinstance(frame, MotionFrame)
        numbers = frame.numbers()
        assert frame.intact and numbers.tolist() == row["numbers"]
        assert plain.decode(row["seq"], row["t_ns"], message.frame) == (row["numbers"], row["grain"], row["stale"])
        sample = frame.sample()
        assert int(sample.stale) == row["stale"]
        assert sample.body.tolist() == (numbers[PLACES["body"]] * scale(row["grain"]).step[PLACES["body"]]).tolist()


@pytest.mark.parametrize("name", cases())
def test_the_encoder_still_makes_the_same_frames(name: str) -> None:
    assert [b64encode(m.frame).decode() for m in cases()[name]] == [row["frame"] for row in stored()[name]]


def test_a_decoder_written_from_the_page_agrees_when_frames_are_lost() -> None:
    rng = np.random.default_rng(7)
    decoder, plain, encoder = MotionDecoder(), plain_decoder(), MotionEncoder()
    read = 0
    for sample in moving(8, 90, True):
        message = encoder.encode(sample)
        if rng.random() < 0.05:
            continue
        frame = decoder.open(message)
        found = plain.decode(sample.seq, sample.t_ns, message.frame)
        assert (frame is None) == (found is None)
        if isinstance(frame, MotionFrame) and found is not None:
            read += 1
            assert frame.numbers().tolist() == found[0]
    assert read > 30


def write() -> None:
    out = stored()
    for name, messages in cases().items():
        plain, rows = plain_decoder(), []
        for m in messages:
            found = plain.decode(m.header.seq, m.header.t_ns, m.frame)
            assert found is not None and all(math.isfinite(n) for n in found[0])
            rows.append(
                {
                    "seq": m.header.seq,
                    "t_ns": m.header.t_ns,
                    "frame": b64encode(m.frame).decode(),
                    "grain": found[1],
                    "stale": found[2],
                    "numbers": found[0],
                }
            )
        out[name] = rows
    lines = [
        f"{json.dumps(name)}: [\n" + ",\n".join(json.dumps(r, separators=(",", ":")) for r in rows) + "\n]"
        for name, rows in out.items()
    ]
    VECTORS.write_text("{\n" + ",\n".join(lines) + "\n}\n", "ascii")


if __name__ == "__main__":
    write()
