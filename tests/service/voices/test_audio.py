"""Two sites' audio services on one bus, in simulated time: heard as late as seen, and what goes wrong with devices."""

from __future__ import annotations

import asyncio
import wave
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vistel.audio.capture import MicrophoneCapture
from vistel.audio.delay_policy import Policy
from vistel.audio.opus import FRAME_NS, RATE
from vistel.audio.visemes import from_bytes
from vistel.v1.audio_pb2 import EquipmentStatus, SoundStatus, VoiceControl
from vistel.v1.service_pb2 import ImageDelay
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services.audio import Config, Microphone, run
from vistel_services.audio.inputs import InputOpener
from vistel_sim.faults import Fault
from vistel_sim.microphone import SimulatedMicrophone, SimulatedVoice, clap, run_microphones

START_NS = 1_000_000_000_000


def always(t_s: float) -> float:
    return 0.8


def turns(t_s: float) -> float:
    return 0.8 if t_s % 1.2 < 0.8 else 0.0


class Conference:
    """ann at tokyo speaks into a simulated microphone (or what is given); bob at oslo hears her."""

    def __init__(
        self,
        folder: Path,
        source: str = "",
        loudness: Callable[[float], float] = turns,
        policy: Policy | None = None,
        loudspeaker: str = "",
        delay_unit: str = "",
        push_to_talk: bool = False,
    ) -> None:
        self.clock = SimulatedClock(START_NS)
        self.network = MemoryNetwork()
        self.microphone = SimulatedMicrophone(
            "ann-microphone", SimulatedVoice(loudness, lambda a, b: (), 5), folder / "ann-microphone"
        )
        self._simulated = not source
        self.heard = folder / "heard.wav"
        mine = Microphone("ann", source or str(folder / "ann-microphone"), push_to_talk)
        self._configs = [
            Config("tokyo", "ann", (mine,), stream=False, spatial="off", memory=folder / "muted.json"),
            Config("oslo", "bob", (), loudspeaker or str(self.heard), policy or Policy(), "off", delay_unit=delay_unit),
        ]
        self.image_s: float | None = None

    async def begin(self) -> None:
        buses = [self.network.bus("c", site, self.clock) for site in ("tokyo", "oslo")]
        self.tokyo, self.oslo = buses
        self._status = self.network.bus("c", "hub", self.clock).subscribe(BY_NAME["sound_status"])
        self._delay = self.oslo.publish(BY_NAME["image_delay"])
        self._tasks = [asyncio.create_task(run(c, b, self.clock)) for c, b in zip(self._configs, buses, strict=True)]
        if self._simulated:
            self._tasks.append(asyncio.create_task(run_microphones([self.microphone], self.clock, START_NS)))
        self.said: dict[str, SoundStatus] = {}
        if self._simulated:
            self.microphone.put(-1)  # plugged in before the service looks

    async def go_on(self, seconds: float) -> None:
        """Let time pass; the renderer reports twice a second."""
        for _ in range(round(seconds / 0.5)):
            if self.image_s is not None:
                message = ImageDelay(site="oslo")
                message.header.t_ns = self.clock.now_ns()
                message.streams.add(participant="ann", delay_s=self.image_s)
                self._delay.put(message)
            for _ in range(25):
                await self.clock.advance_to_ns(self.clock.now_ns() + 20_000_000)
            for task in self._tasks:
                if task.done():
                    task.result()
            for sample in self._status.take():
                self.said[sample.message.site] = sample.message

    @property
    def voice(self) -> SoundStatus.Stream:
        return self.said["oslo"].streams[0]

    @property
    def mouth(self) -> SoundStatus.Microphone:
        return self.said["tokyo"].microphones[0]

    async def end(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def sound(self) -> np.ndarray:
        with wave.open(str(self.heard)) as file:
            assert (file.getframerate(), file.getnchannels()) == (RATE, 2)
            return np.frombuffer(file.readframes(file.getnframes()), "<i2").reshape(-1, 2) / 32768.0


def play(conference: Conference, script: Callable[[Conference], Coroutine[Any, Any, None]]) -> None:
    async def main() -> None:
        await conference.begin()
        try:
            await script(conference)
        finally:
            await conference.end()

    asyncio.run(main())


def set_fault(conference: Conference, kind: Any, seconds: float) -> None:
    now_s = (conference.clock.now_ns() - START_NS) * 1e-9
    conference.microphone.set_faults(Fault("ann-microphone", kind, now_s, seconds))


def test_a_voice_is_heard_as_late_as_it_is_seen_and_follows_the_picture(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        c.image_s = 0.15
        await c.go_on(4.0)
        assert c.voice.actual_s == pytest.approx(0.15, abs=0.003)
        assert c.voice.skew_s == pytest.approx(0.0, abs=0.003)
        assert c.voice.needed_s < 0.1
        c.image_s = 0.21
        await c.go_on(6.0)
        assert c.voice.actual_s == pytest.approx(0.21, abs=0.003)
        assert c.voice.concealed < 0.01 * c.voice.frames

    conference = Conference(tmp_path)
    play(conference, script)
    sound = conference.sound()
    assert sound.std() > 0.03


def test_the_fixed_delay_of_the_dissertation_does_not_follow(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        c.image_s = 0.15
        await c.go_on(3.0)
        assert c.voice.actual_s == pytest.approx(0.2, abs=0.003)
        assert c.voice.skew_s == pytest.approx(0.05, abs=0.004)
        assert c.said["oslo"].policy == "fixed 0.2"

    play(Conference(tmp_path, policy=Policy(0.2)), script)


def test_the_indicator_shows_who_speaks_when_it_is_heard(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        await c.go_on(3.0)
        seen = []
        for _ in range(12):
            await c.go_on(0.5)
            seen.append(c.voice.talking)
        assert True in seen

    play(Conference(tmp_path, loudness=lambda t: 0.8 if t % 5.0 < 2.5 else 0.0), script)


def test_mute_and_push_to_talk_close_and_open_the_microphone(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        control = c.tokyo.publish(BY_NAME["voice_control"], participant="ann")
        await c.go_on(2.0)
        assert c.mouth.muted
        assert not c.said["oslo"].streams
        control.put(VoiceControl(participant="ann", push_to_talk=True, talk=True))
        await c.go_on(2.0)
        heard = c.voice.frames
        assert heard > 50
        control.put(VoiceControl(participant="ann", muted=True))
        await c.go_on(2.0)
        assert c.mouth.muted
        assert c.voice.frames - heard < 30
        assert not c.voice.talking
        c._tasks.pop(0).cancel()
        c._tasks.insert(0, asyncio.create_task(run(c._configs[0], c.network.bus("c", "tokyo", c.clock), c.clock)))
        await c.go_on(1.0)
        assert c.mouth.muted, "a service that was started again has opened a muted microphone"

    play(Conference(tmp_path, loudness=always, push_to_talk=True), script)


def test_a_microphone_that_is_unplugged_is_named_and_comes_back(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        await c.go_on(2.0)
        assert c.mouth.open
        set_fault(c, "unplug", 3.0)
        await c.go_on(2.0)
        assert not c.mouth.open
        assert "ann-microphone" in c.mouth.detail
        await c.go_on(5.0)
        assert c.mouth.open
        assert c.mouth.detail == ""
        assert c.voice.talking

    play(Conference(tmp_path, loudness=always), script)


def test_a_silent_device_is_named_and_its_next_word_is_heard_on_time(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        c.image_s = 0.15
        await c.go_on(2.0)
        set_fault(c, "stall", 3.0)
        await c.go_on(2.5)
        assert "no samples come" in c.mouth.detail
        await c.go_on(4.0)
        assert c.mouth.open
        assert c.voice.skew_s == pytest.approx(0.0, abs=0.005)

    play(Conference(tmp_path, loudness=always), script)


def test_each_message_carries_the_frame_before_it_once_more_and_none_across_a_pause(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        said = c.oslo.subscribe(BY_NAME["voice"], queue_all=True)
        await c.go_on(6.0)
        before: Any = None
        pauses = 0
        for message in (s.message for s in said.take()):
            follows = before is not None and message.header.t_ns - before.header.t_ns == FRAME_NS and bool(before.opus)
            assert list(message.earlier) == ([before.opus] if follows else [])
            pauses += not follows
            before = message
        assert pauses >= 2

    play(Conference(tmp_path), script)


def test_each_message_carries_the_shapes_of_the_mouth_and_the_one_that_ends_a_talk_none(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        said = c.oslo.subscribe(BY_NAME["voice"], queue_all=True)
        await c.go_on(6.0)
        messages = [s.message for s in said.take()]
        assert len(messages) > 100
        assert all((from_bytes(m.visemes) is not None) == bool(m.opus) for m in messages)
        assert len({m.visemes for m in messages}) > 20

    play(Conference(tmp_path), script)


def test_over_a_thin_uplink_three_frames_go_in_a_message_each_once_and_all_are_heard(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        c.image_s = 0.15
        await c.go_on(4.0)
        received = c.network.bus("c", "hub", c.clock).subscribe(BY_NAME["voice"], queue_all=True)
        c.tokyo.uplink.follow(1.0, c.clock.now_ns())
        await c.go_on(2.0)
        before = c.voice.frames, c.voice.concealed
        received.take()
        await c.go_on(4.0)
        voices = [s.message for s in received.take()]
        assert len(voices) == pytest.approx(4.0 / 0.06, abs=2)
        assert {len(v.earlier) for v in voices} == {2}
        steps = np.diff([v.header.t_ns for v in voices])
        assert np.abs(steps - 3 * FRAME_NS).max() < 1_000_000
        sound_bits = 8 * sum(len(packet) for v in voices for packet in (v.opus, *v.earlier)) / 4.0
        assert sound_bits < 7_000
        assert c.voice.frames - before[0] == pytest.approx(200, abs=15)  # it reports four times a second
        assert c.voice.concealed == before[1]

    play(Conference(tmp_path, loudness=always), script)


@pytest.mark.parametrize("stood_s", [0.3, 0.7])
def test_a_microphone_that_stood_still_for_a_moment_is_heard_with_its_picture_at_once(tmp_path: Path, stood_s: float) -> None:
    async def script(c: Conference) -> None:
        c.image_s = 0.2
        await c.go_on(4.0)
        for _ in range(3):
            set_fault(c, "stall", stood_s)  # what was said meanwhile is missing, and nothing says so
            await c.go_on(6.0)
            assert c.voice.needed_s < 0.12
            assert c.voice.actual_s == pytest.approx(0.2, abs=0.003)
            assert c.voice.skew_s == pytest.approx(0.0, abs=0.003)

    conference = Conference(tmp_path, loudness=always)
    stamps: list[int] = []

    async def watched(c: Conference) -> None:
        voices = c.oslo.subscribe(BY_NAME["voice"], queue_all=True)
        await script(c)
        stamps.extend(s.message.header.t_ns for s in voices.take())

    play(conference, watched)
    steps = np.diff(stamps) / 1e6
    assert np.all(steps > 19.0), "a frame was sent twice, or one before another"
    assert np.count_nonzero(steps >= 1e3 * stood_s - 20.0) >= 3


def test_a_delay_unit_is_asked_for_less_when_the_picture_comes_sooner(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        unit = c.oslo.publish(BY_NAME["equipment_status"], equipment="unit")
        asked = c.oslo.subscribe(BY_NAME["equipment_request"])
        does_s = 0.0013
        for k in range(60):
            for sample in asked.take():
                does_s = 0.0013 + sample.message.settings[0].value
            unit.put(EquipmentStatus(equipment="unit", state=EquipmentStatus.STATE_OBSERVED, delay_known=True, acoustic_s=does_s))
            # A renderer's picture: as late as its drawing makes it, or as the voice that is waited for.
            drawn_s = 0.3 if k < 20 else 0.15
            c.image_s = max(drawn_s + 0.01 * (k % 2), c.voice.needed_s + 0.01 if "oslo" in c.said and k else 0.0)
            await c.go_on(0.5)
            if k == 19:
                assert does_s > 0.15
        assert c.image_s < 0.17
        assert does_s < 0.12
        assert c.voice.skew_s == pytest.approx(0.0, abs=0.012)

    play(Conference(tmp_path, loudness=always, delay_unit="unit"), script)


def test_an_over_driven_microphone_is_reported(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        await c.go_on(1.0)
        assert not c.mouth.clipped
        set_fault(c, "saturation", 2.0)
        await c.go_on(1.0)
        assert c.mouth.clipped
        await c.go_on(3.0)
        assert not c.mouth.clipped

    play(Conference(tmp_path, loudness=always), script)


@pytest.mark.parametrize("rate", [8_000, 22_050, 96_000])
def test_recordings_of_any_rate_are_heard_at_their_pitch(tmp_path: Path, rate: int) -> None:
    t = np.arange(rate) / rate
    with wave.open(str(tmp_path / "said.wav"), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes((12_000 * np.sin(2 * np.pi * 400.0 * t)).astype("<i2").tobytes())

    async def script(c: Conference) -> None:
        await c.go_on(3.0)

    conference = Conference(tmp_path, source=str(tmp_path / "said.wav"))
    play(conference, script)
    part = conference.sound()[RATE : 2 * RATE, 0]
    assert np.argmax(np.abs(np.fft.rfft(part * np.hanning(RATE)))) == pytest.approx(400, abs=2)


@pytest.mark.parametrize(
    ("source", "expected"),
    [("text", "cannot be read as sound"), ("no such device", "no sound card"), ("/nowhere/mic", "does not exist")],
)
def test_what_is_no_microphone_is_named_and_the_rest_goes_on(tmp_path: Path, source: str, expected: str) -> None:
    if source == "text":
        source = str(tmp_path / "said.wav")
        Path(source).write_text("nothing to be heard here")

    async def script(c: Conference) -> None:
        await c.go_on(1.0)
        while c.mouth.detail == "not opened yet":
            await asyncio.sleep(0.01)  # sound cards are looked for on a thread, which simulated time does not wait for
            await c.go_on(0.5)
        assert not c.mouth.open
        assert expected in c.mouth.detail
        assert c.said["oslo"].loudspeaker.endswith("heard.wav")

    play(Conference(tmp_path, source=source), script)


def test_a_loudspeaker_that_is_not_there_is_named_and_voices_are_timed_all_the_same(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        c.image_s = 0.15
        await c.go_on(2.0)
        while not c.said["oslo"].loudspeaker_detail:
            await asyncio.sleep(0.01)  # as above
            await c.go_on(0.5)
        assert c.voice.actual_s == pytest.approx(0.15, abs=0.003)

    play(Conference(tmp_path, loudness=always, loudspeaker="no such loudspeaker"), script)


def test_with_a_delay_unit_the_voice_leaves_earlier_by_what_the_unit_says(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        unit = c.oslo.publish(BY_NAME["equipment_status"], equipment="unit")
        asked = c.oslo.subscribe(BY_NAME["equipment_request"])
        c.image_s = 0.25
        await c.go_on(1.0)
        assert not c.said["oslo"].acoustic_known
        does_s = 0.0013
        for _ in range(12):
            for sample in asked.take():
                does_s = 0.0013 + sample.message.settings[0].value
            unit.put(EquipmentStatus(equipment="unit", state=EquipmentStatus.STATE_OBSERVED, delay_known=True, acoustic_s=does_s))
            await c.go_on(0.5)
        assert c.said["oslo"].acoustic_known
        assert does_s > 0.1
        assert c.voice.actual_s == pytest.approx(0.25, abs=0.004)
        assert c.said["oslo"].output_s == pytest.approx(does_s, abs=0.002)

    play(Conference(tmp_path, delay_unit="unit"), script)


def test_an_hour_of_silence_is_nothing(tmp_path: Path) -> None:
    async def script(c: Conference) -> None:
        await c.go_on(2.0)
        c._tasks.pop().cancel()
        await c.clock.advance_to_ns(c.clock.now_ns() + 1_000_000_000)
        frames = c.voice.frames
        c.clock._now_ns += 3_600_000_000_000
        c._tasks.append(asyncio.create_task(run_microphones([c.microphone], c.clock, c.clock.now_ns())))
        await c.go_on(4.0)
        assert c.mouth.open
        assert c.voice.frames > frames + 100
        assert c.voice.talking

    play(Conference(tmp_path, loudness=always), script)


@pytest.mark.parametrize("begins_ms", [0, 7, 13, 19])
def test_a_simulated_microphones_sound_is_stamped_when_it_was_made_however_its_blocks_lie(tmp_path: Path, begins_ms: int) -> None:
    """A burst at known times since the microphone began, of which block after block comes between two rounds."""
    first_ns = START_NS + begins_ms * 1_000_000
    heard: list[tuple[int, np.ndarray]] = []

    async def main() -> None:
        clock = SimulatedClock(START_NS)
        voice = SimulatedVoice(lambda t: 0.0, lambda a, b: [n for n in (2, 3, 4) if a < n <= b], 5)
        microphone = SimulatedMicrophone("ann-microphone", voice, tmp_path / "ann")
        tasks = [asyncio.create_task(run_microphones([microphone], clock, first_ns))]
        capture = MicrophoneCapture("ann", InputOpener(str(tmp_path / "ann"), clock))
        for _ in range(250):
            heard.extend(capture.frames(clock.now_ns()))
            await clock.advance_to_ns(clock.now_ns() + FRAME_NS)
        tasks[0].cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        capture.close()

    asyncio.run(main())
    sound, begin_ns = np.concatenate([pcm for _, pcm in heard]), heard[0][0]
    assert [t for t, _ in heard] == [begin_ns + k * FRAME_NS for k in range(len(heard))]
    for n in (2, 3, 4):
        at = round((first_ns + n * 1_000_000_000 - begin_ns) * 1e-9 * RATE)
        part = sound[at - RATE // 20 : at + RATE // 20]
        found = int(np.argmax(np.abs(np.correlate(part, clap(), "valid")))) - RATE // 20
        assert found / RATE * 1e3 == pytest.approx(0.0, abs=1.0), "milliseconds after it was made"
