"""Sound cards as PortAudio shows them: opened, gone, back, looked for without disturbing others more than now and then."""

from __future__ import annotations

import asyncio
import sys
import threading
import types
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vistel.audio import cards
from vistel.audio.capture import MicrophoneCapture, SoundDeviceError
from vistel.audio.opus import FRAME, FRAME_NS, RATE
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services.audio import Config, Microphone, run
from vistel_services.audio.inputs import CardInput, InputOpener
from vistel_services.audio.outputs import CardOutput, Loudspeaker
from vistel_sim.microphone import SimulatedMicrophone, SimulatedVoice, run_microphones

SECOND_NS = 1_000_000_000


class PortAudio:
    """Behaves as the library does: sees what is plugged in when it begins, and ends every stream when it begins anew."""

    def __init__(self) -> None:
        self.plugged = ["Headset", "Speakers"]
        self.seen = list(self.plugged)
        self.streams: list[Stream] = []
        self.begun = 0
        self.only_rate: float | None = None

    def module(self) -> types.ModuleType:
        out: Any = types.ModuleType("sounddevice")
        out.query_devices = self.query
        out.check_input_settings = self.check
        out.InputStream = lambda **settings: Stream(self, False, **settings)
        out.OutputStream = lambda **settings: Stream(self, True, **settings)
        out._terminate = lambda: [s.end() for s in self.streams]
        out._initialize = self.begin
        return out

    def begin(self) -> None:
        self.begun += 1
        self.seen = list(self.plugged)

    def query(self, device: int | None = None, kind: str = "") -> Any:
        able = {"Headset": (1, 2), "Speakers": (0, 2)}
        found = [
            {
                "name": n,
                "index": i,
                "max_input_channels": able[n][0],
                "max_output_channels": able[n][1],
                "default_samplerate": self.only_rate or 44_100.0,
            }
            for i, n in enumerate(self.seen)
        ]
        return found[device or 0] if kind else found

    def check(self, samplerate: float, **_: Any) -> None:
        if self.only_rate not in (None, samplerate):
            raise ValueError("Invalid sample rate")

    def unplug(self, name: str) -> None:
        self.plugged.remove(name)
        for stream in self.streams:
            if stream.name == name:
                stream.active = False


class AtOnce(Executor):
    """Does on the caller's thread what a thread is to do."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as e:
            future.set_exception(e)
        return future


class Stream:
    latency = 0.01

    def __init__(
        self, portaudio: PortAudio, is_output: bool, *, device: int | None, callback: Any, samplerate: float, **_: Any
    ) -> None:
        self.name = portaudio.seen[device or 0]
        if self.name not in portaudio.plugged:
            raise OSError("Device unavailable")
        self.active, self._is_output, self._callback, self.rate = False, is_output, callback, samplerate
        portaudio.streams.append(self)

    def start(self) -> None:
        self.active = True

    def end(self) -> None:
        self.active = False

    close = end

    def go_on(self, samples: np.ndarray) -> np.ndarray:
        """One call of PortAudio's thread."""
        time = types.SimpleNamespace(currentTime=5.0, inputBufferAdcTime=4.99, outputBufferDacTime=5.03)
        block = np.zeros((FRAME, 2), np.float32) if self._is_output else samples[:, None]
        self._callback(block, len(block), time, None)
        return block


@pytest.fixture
def portaudio(monkeypatch: pytest.MonkeyPatch) -> Iterator[PortAudio]:
    out = PortAudio()
    monkeypatch.setitem(sys.modules, "sounddevice", out.module())
    monkeypatch.setattr(cards, "thread", AtOnce())
    yield out
    for who in list(cards._open):
        who.release()
    cards._searched_ns.clear()


def live(portaudio: PortAudio, name: str) -> Stream:
    return next(s for s in reversed(portaudio.streams) if s.name == name and s.active)


def test_a_microphone_that_is_opened_leaves_the_loudspeaker_on(portaudio: PortAudio) -> None:
    clock = SimulatedClock(SECOND_NS)
    loudspeaker = CardOutput("speakers", clock)
    CardInput("headset", clock)
    live(portaudio, "Speakers").go_on(np.zeros(0))
    assert loudspeaker.due(clock.now_ns()) is not None
    assert portaudio.begun == 1


@pytest.mark.parametrize("rate", [8_000.0, 44_100.0, 96_000.0])
def test_a_card_that_refuses_48_khz_is_read_at_its_own_rate(portaudio: PortAudio, rate: float) -> None:
    portaudio.only_rate = rate
    clock = SimulatedClock(SECOND_NS)
    capture = MicrophoneCapture("ann", InputOpener("headset", clock))
    frames: list[Any] = []
    tone = np.sin(2 * np.pi * 400.0 * np.arange(round(rate)) / rate).astype(np.float32)
    part = round(rate * 0.02)
    for k in range(50):
        frames += capture.frames(clock.now_ns())
        clock._now_ns += FRAME_NS
        live(portaudio, "Headset").go_on(tone[k * part : (k + 1) * part])
    assert capture.rate_hz == pytest.approx(rate, rel=1e-3)
    assert len(frames) > 40
    said = np.concatenate([pcm for _, pcm in frames])[-RATE // 2 :]
    assert np.argmax(np.abs(np.fft.rfft(said * np.hanning(len(said))))) == pytest.approx(200, abs=1)


def test_what_small_blocks_bring_in_a_second_is_kept_and_no_more_than_is_asked_for(portaudio: PortAudio) -> None:
    card = CardInput("headset", SimulatedClock(SECOND_NS), keep_s=1.0)
    sound = np.arange(2 * RATE, dtype=np.float32)
    stream = live(portaudio, "Headset")
    for at in range(0, RATE, 100):
        stream.go_on(sound[at : at + 100])
    assert np.array_equal(np.concatenate([samples for samples, _ in card.take()]), sound[:RATE])
    assert card.take() == []
    for at in range(0, 2 * RATE, 100):
        stream.go_on(sound[at : at + 100])
    assert np.array_equal(np.concatenate([samples for samples, _ in card.take()]), sound[RATE:])


def rounds(clock: SimulatedClock, seconds: float, step: Callable[[int], object]) -> None:
    for _ in range(round(seconds / 0.1)):
        step(clock.now_ns())
        clock._now_ns += SECOND_NS // 10


def test_a_microphone_that_is_unplugged_is_named_and_found_again_while_the_loudspeaker_goes_on(portaudio: PortAudio) -> None:
    clock = SimulatedClock(SECOND_NS)
    loudspeaker = Loudspeaker("speakers", clock)
    capture = MicrophoneCapture("ann", InputOpener("headset", clock))

    def step(now_ns: int) -> None:
        loudspeaker.due(now_ns)
        capture.frames(now_ns)

    rounds(clock, 1.0, step)
    assert capture.about == "Headset"
    portaudio.unplug("Headset")
    rounds(clock, 30.0, step)
    assert "Headset" in capture.detail or "no sound card" in capture.detail or "cannot be opened" in capture.detail
    assert 2 <= portaudio.begun <= 4, "the loudspeaker is interrupted all the time"
    assert loudspeaker.about == "Speakers"
    portaudio.plugged.insert(0, "Headset")
    rounds(clock, 20.0, step)
    live(portaudio, "Headset").go_on(np.zeros(FRAME, np.float32))
    capture.frames(clock.now_ns())
    assert capture.is_open
    assert loudspeaker.about == "Speakers"
    assert loudspeaker.detail == ""


def test_without_portaudio_the_error_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    monkeypatch.setattr(cards, "thread", AtOnce())
    loudspeaker = Loudspeaker("auto", SimulatedClock(SECOND_NS))
    assert loudspeaker.due(SECOND_NS) is not None, "time does not go on without a sound card"
    assert "pip install" in loudspeaker.detail
    with pytest.raises(SoundDeviceError, match="no sound card can be used"):
        CardInput("default", SimulatedClock(SECOND_NS))


def test_a_card_that_is_looked_for_for_seconds_delays_no_voice(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    portaudio = PortAudio()
    module: Any = portaudio.module()
    asked, answer = threading.Event(), threading.Event()

    def slow_query(*args: Any) -> Any:
        asked.set()
        assert answer.wait(60.0)
        return portaudio.query(*args)

    module.query_devices = slow_query
    monkeypatch.setitem(sys.modules, "sounddevice", module)
    pipe = tmp_path / "ann-microphone"
    microphone = SimulatedMicrophone("ann-microphone", SimulatedVoice(lambda _: 0.8, lambda a, b: (), 5), pipe)
    config = Config(
        "tokyo", "ann", (Microphone("ann", str(pipe)),), "speakers", spatial="off", stream=False, memory=tmp_path / "muted.json"
    )

    async def scene() -> None:
        clock, network = SimulatedClock(SECOND_NS), MemoryNetwork()
        listening = network.bus("c", "oslo", clock)
        voices = listening.subscribe(BY_NAME["voice"], queue_all=True)
        statuses = listening.subscribe(BY_NAME["sound_status"])
        microphone.put(-1)
        tasks = [
            asyncio.create_task(run(config, network.bus("c", "tokyo", clock), clock)),
            asyncio.create_task(run_microphones([microphone], clock, clock.now_ns())),
        ]

        async def pass_time(seconds: float) -> None:
            for _ in range(round(seconds / 0.02)):
                await clock.advance_to_ns(clock.now_ns() + FRAME_NS)

        await pass_time(1.0)
        await asyncio.to_thread(asked.wait, 60.0)
        voices.take()
        await pass_time(3.0)
        times = [s.received_ns for s in voices.take()]
        assert not answer.is_set()
        assert len(times) >= 145, "voices waited for the sound card"
        assert max(np.diff(times)) <= 2 * FRAME_NS
        answer.set()
        shown = ""
        while shown != "Speakers":
            await asyncio.sleep(0.01)  # the cards' thread is a real one
            await pass_time(0.5)
            shown = next((s.message.loudspeaker for s in statuses.take()), shown)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(scene())
    assert cards.thread.submit(lambda: list(cards._open)).result() == []
