"""`vistel log redact`: nothing of who the people are is left in any byte, and what they did is."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import json_format
from hypothesis import given
from hypothesis import strategies as st
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from typer.testing import CliRunner, Result

import vistel.log
from vistel.log.redact import Pseudonyms
from vistel.v1.audio_pb2 import Voice
from vistel.v1.device_pb2 import FaceFrame, PointerFrame
from vistel.v1.motion_pb2 import AvatarPart, Participant
from vistel.v1.speech_pb2 import Utterance
from vistel.v1.world_pb2 import WorldInputs
from vistel.wire.log import LogReader, LogRecord, LogWriter
from vistel.wire.motion import MotionDecoder, MotionEncoder
from vistel.wire.topics import BY_NAME
from vistel_cli.main import app

MEETING = Path(__file__).parents[1] / "replay" / "meeting.mcap"
CALLED = {"aiko": "quirinia", "ben": "zebulon"}
"""In place of the meeting's names, which are those of built-in figures, too."""
SHOWN, SPOKEN_OF, VOICE = "田中ケイコ", "Xanthippe", b"\xfcvoice-of-quirinia"
GONE = [*CALLED.values(), SHOWN, SPOKEN_OF, "voice-of", "face-of"]


def called(text: str) -> str:
    return re.sub("(?<!person=)(aiko|ben)", lambda m: CALLED[m[0]], text)


def of_people() -> Iterator[tuple[str, dict[str, str], Any]]:
    """What tells who somebody is: topic, names of the key, message."""
    where = {"participant": "quirinia"}
    yield "participant", where, Participant(participant="quirinia", display_name=SHOWN, avatar="quirinia.glb", parcel="0" * 32)
    yield "avatar_part", {"digest": "0" * 32, "part": "0000"}, AvatarPart(parts=1, size=9, data=b"face-of-quirinia")
    yield "voice", where, Voice(opus=VOICE, earlier=[VOICE], talking=True)
    yield "utterance", where, Utterance(participant="quirinia", text=f"{SPOKEN_OF}, give ZEBULON the ball", reply="Yes, Zebulon.")
    yield "face", {"device": "quirinia-face"}, FaceFrame(device="quirinia-face", marks=[0.25] * 26)
    yield "pointer", {"device": "zebulon-pointer"}, PointerFrame(device="zebulon-pointer", guest={"display_name": SHOWN})
    yield "world_inputs", {}, WorldInputs(private_state=b'{"people": ["zebulon"]}')


def written(path: Path) -> Path:
    """The meeting, of people with names of their own, who speak and have faces."""
    reader = LogReader(MEETING)
    text = called(reader.conference_toml or "").replace('display_name = ""', f'display_name = "{SHOWN}"', 1)
    coders: dict[str, tuple[MotionDecoder, MotionEncoder]] = {}
    with LogWriter(path, text) as writer:
        for n, r in enumerate(reader.records()):
            message = json_format.Parse(called(json_format.MessageToJson(r.message)), type(r.message)())
            message.ClearField("check") if "check" in message.DESCRIPTOR.fields_by_name else None
            if r.topic.name == "motion":
                message = with_face(r, *coders.setdefault(r.key, (MotionDecoder(), MotionEncoder())))
            writer.write(r.topic, called(r.key), message, r.log_ns)
            if n == 200:
                for topic, names, told in of_people():
                    told.header.CopyFrom(r.message.header)
                    key = BY_NAME[topic].format(conference="meeting", site="tokyo", **names)
                    writer.write(BY_NAME[topic], key, told, r.log_ns)
    return path


def with_face(record: LogRecord, decoder: MotionDecoder, encoder: MotionEncoder) -> Any:
    sample = decoder.decode(record.message)
    assert sample is not None
    message = encoder.encode(replace(sample, face=np.full(26, 0.05)))
    message.header.CopyFrom(record.message.header)
    return message


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A log, and the same redacted."""
    folder = tmp_path_factory.mktemp("redacted")
    log = written(folder / "log.mcap")
    done = call("redact", log, "--out", folder / "shared.mcap", "--name", SPOKEN_OF)
    assert done.exit_code == 0, done.output
    return log, folder / "shared.mcap"


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["log", *map(str, arguments)], env={"COLUMNS": "160"})


def every_byte(path: Path) -> bytes:
    """Of a log, as it is and with its chunks unpacked."""
    with path.open("rb") as file:
        chunks = [r for r in StreamReader(file, emit_chunks=True).records if type(r).__name__ == "Chunk"]
    unpacked = [get_chunk_data_stream(c)[0] for c in chunks]  # type: ignore[arg-type]
    return b"".join([path.read_bytes(), *(s._stream.getvalue() for s in unpacked)])  # type: ignore[attr-defined]


def test_no_byte_holds_a_name_a_voice_a_likeness_or_a_word_that_was_said(logs: tuple[Path, Path]) -> None:
    before, after = (every_byte(path).lower() for path in logs)
    for gone in GONE:
        assert gone.lower().encode() in before
        assert gone.lower().encode() not in after, gone


def test_faces_are_gone_and_postures_are_the_same(logs: tuple[Path, Path]) -> None:
    log, shared = (vistel.log.open(path) for path in logs)
    assert shared.participants == ["person-1", "person-2"] and not shared.damage
    for who, name in (("quirinia", "person-1"), ("zebulon", "person-2")):
        there, here = list(log.postures(who)), list(shared.postures(name))
        assert len(here) == len(there) > 300
        for (t, a), (u, b) in zip(there, here, strict=True):
            assert t == u and np.array_equal(a.dofs, b.dofs) and np.array_equal(a.hands, b.hands)
        decoder = MotionDecoder()
        samples = [decoder.decode(m.message) for m in shared.messages("motion", participant=name)]
        assert samples and all(s is not None and s.face is None for s in samples)


def test_the_room_is_the_same_by_other_names(logs: tuple[Path, Path]) -> None:
    there, here = (list(vistel.log.open(path).rooms()) for path in logs)
    names = {"quirinia": "person-1", "zebulon": "person-2"}
    assert len(here) == len(there) > 100
    assert any(room.touching for _, room in there)
    for (t, a), (u, b) in zip(there, here, strict=True):
        assert t == u and a.things.keys() == b.things.keys()
        renamed = {tuple(names.get(body, body) for body in pair) for pair in a.touching}
        assert {frozenset(pair) for pair in b.touching} == {frozenset(pair) for pair in renamed}


def test_devices_that_tell_postures_are_kept_byte_for_byte(logs: tuple[Path, Path]) -> None:
    log, shared = (LogReader(path) for path in logs)
    there, here = ([r.message.data for r in reader.records(("device_raw",))] for reader in (log, shared))
    assert here == there and here


def test_it_is_computed_anew_from_devices_as_the_log_itself(logs: tuple[Path, Path], tmp_path: Path) -> None:
    arguments = ("replay", logs[1], "--source", "devices", "--fast", "--out", tmp_path, "--against", logs[1], "--to", "3")
    done = CliRunner().invoke(app, [*map(str, arguments)])
    assert done.exit_code == 0, done.output


def test_what_cannot_be_redacted_gets_one_line(logs: tuple[Path, Path], tmp_path: Path) -> None:
    with LogWriter(tmp_path / "bare.mcap"):
        pass
    for arguments, said in (
        ((tmp_path / "bare.mcap", "--out", tmp_path / "x.mcap"), "nobody knows whose names"),
        ((logs[0], "--out", logs[0], "--force"), "is the log itself"),
        ((tmp_path / "no.mcap", "--out", tmp_path / "x.mcap"), "no such file"),
        ((logs[0], "--out", tmp_path / "no" / "x.mcap"), "cannot be written"),
    ):
        done = call("redact", *arguments)
        assert done.exit_code in (1, 2) and said in done.stderr and "Traceback" not in done.output, done.output


def test_a_log_cut_off_anywhere_or_with_a_flipped_byte_is_redacted_and_exported_as_far_as_it_goes_or_refused_in_one_line(
    logs: tuple[Path, Path], tmp_path: Path
) -> None:
    whole = logs[0].read_bytes()
    rng = np.random.default_rng(3)
    for n in range(10):
        at = int(rng.integers(0, len(whole)))
        damaged = tmp_path / f"{n}.mcap"
        damaged.write_bytes(whole[:at] if n % 2 else whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1 :])
        for arguments in (
            ("redact", damaged, "--name", SPOKEN_OF, "--out", tmp_path / "out.mcap", "--force"),
            ("export", damaged, "--foxglove", "--fps", "5", "--out", tmp_path / "viewed.mcap", "--force"),
            ("export", damaged, "--npz", "zebulon", "--out", tmp_path / "z.npz", "--force"),
        ):
            done = call(*arguments)
            assert done.exit_code in (0, 1, 2), (n, at, arguments, done.output)
            assert done.exception is None or isinstance(done.exception, SystemExit), (n, at, arguments, done.exception)
        if (tmp_path / "out.mcap").exists():
            left = every_byte(tmp_path / "out.mcap").lower()
            assert not [gone for gone in GONE if gone.lower().encode() in left]


def test_of_a_newer_version_and_with_time_that_goes_back_what_can_be_read_is_redacted(
    logs: tuple[Path, Path], tmp_path: Path
) -> None:
    reader = LogReader(logs[0])
    for name, version, back_ns in (("newer", 2, 0), ("back", 1, 1_500_000_000)):
        middle_ns = (reader.begin_ns + reader.end_ns) // 2
        with LogWriter(tmp_path / f"{name}.mcap", reader.conference_toml) as writer:
            for r in reader.records():
                r.message.header.version = version
                late = r.log_ns > middle_ns
                writer.write(r.topic, r.key, r.message, r.log_ns - back_ns * late)
        done = call("redact", tmp_path / f"{name}.mcap", "--name", SPOKEN_OF, "--out", tmp_path / "out.mcap", "--force")
        assert done.exit_code == 0, done.output
        assert ("version 2, this is 1" in done.stderr) is (name == "newer")
        left = every_byte(tmp_path / "out.mcap").lower()
        assert not [gone for gone in GONE if gone.lower().encode() in left]


def test_a_name_is_found_beside_words_of_another_script_and_not_within_one_of_its_own() -> None:
    names = Pseudonyms(["ben", "ben-2", "keiko"], {"田中": "keiko"})
    assert (
        names.text("benさん、BEN-2 と田中さん; bend, ben_tracker")
        == "person-1さん、person-2 とperson-3さん; bend, person-1_tracker"
    )


@given(st.lists(st.from_regex(r"[a-z0-9][a-z0-9_\-]{0,31}", fullmatch=True), min_size=1, max_size=8, unique=True), st.text())
def test_no_name_stands_as_a_word_in_a_text_afterwards(names: list[str], text: str) -> None:
    pseudonyms = Pseudonyms(names, {})
    said = pseudonyms.text(f"{text} {' '.join(names)} {text.join(names)}")
    numbers = {f"person-{n}" for n in range(1, len(names) + 1)}
    left = [m[0] for name in names for m in re.finditer(rf"(?<![0-9A-Za-z]){re.escape(name)}(?![0-9A-Za-z])", said)]
    assert all(any(word in number for number in numbers) for word in left)
