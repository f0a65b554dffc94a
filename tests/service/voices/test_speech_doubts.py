"""What is not believed to have been said to the room: noise, pieces, other people's words, the room's own, while it is closed."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from functools import wraps

import numpy as np
import pytest

from vistel.audio.opus import FRAME, FRAME_NS, RATE, Encoder
from vistel.speech.engines.guarded import REST_NS
from vistel.speech.grammar_file import load_grammar
from vistel.speech.recognition import Hypotheses, Hypothesis, Samples
from vistel.speech.voice_reader import BEHIND_NS, VoiceReader
from vistel.v1.audio_pb2 import Voice, VoiceControl
from vistel.v1.speech_pb2 import Utterance
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel_services.speech.config import Config, Speaker
from vistel_services.speech.echoes import Echoes
from vistel_services.speech.listener import Listener

START_NS = 1_000_000_000_000


def in_a_loop(test: Callable[..., None]) -> Callable[..., None]:
    """A bus belongs to a loop."""

    @wraps(test)
    def run(**fixtures: object) -> None:
        async def main() -> None:
            test(**fixtures)

        asyncio.run(main())

    return run


MOVE, PUSH = "はこをみぎにうごかして", "おして"
GRAMMAR, _ = load_grammar()


def words(text: str) -> tuple[str, ...]:
    said = GRAMMAR.read(text)
    assert said is not None
    return tuple(w.name for w in said.words)


class Believes:
    """Hears `text` wherever there is sound for long enough, as surely as it is told to: a recogniser at its worst."""

    def __init__(self, text: str, confidence: float) -> None:
        self._heard, self._confidence = words(text), confidence
        self.reset()

    def reset(self) -> None:
        self._count = 0

    def feed(self, samples: Samples) -> list[Hypotheses]:
        before, self._count = self._count, self._count + len(samples)
        if not before < 16_000 <= self._count:
            return []
        return [(Hypothesis(self._heard, self._confidence, 0.2, 0.9),)]

    def flush(self) -> list[Hypotheses]:
        return []


class Told(Echoes):
    """And all that was told."""

    def __init__(self) -> None:
        super().__init__()
        self.utterances: list[Utterance] = []

    def add(self, utterance: Utterance) -> None:
        super().add(utterance)
        self.utterances.append(utterance)


class Person:
    """ann, her microphone's messages and what the room makes of them."""

    def __init__(
        self,
        text: str = MOVE,
        confidence: float = 0.9,
        listen: str = "open",
        name: str = "ann",
        echoes: Told | None = None,
        replies: bool = False,
    ) -> None:
        bus = MemoryNetwork().bus("c", "tokyo", SimulatedClock(START_NS))
        self._told = echoes or Told()
        config = Config("tokyo", (), listen, reply="text")  # type: ignore[arg-type]
        self.recogniser = Believes(text, confidence)
        speaker = Speaker(name)
        self.listener = Listener(config, speaker, GRAMMAR, self.recogniser, bus, self._told, lambda t_ns: replies)
        self._encoder = Encoder(1, 24_000)
        self.now_ns = START_NS

    def hears(self, seconds: float = 1.4, *, talking: bool = True, lost: Sequence[int] = (), at_once: bool = False) -> list[str]:
        """Sound for so long, without some of its frames; what it came to. at_once: the service was kept from listening."""
        t = np.arange(FRAME) / RATE
        for k in range(round(seconds / 0.02)):
            pcm = (0.2 * np.sin(2 * np.pi * 220.0 * (t + k * 0.02))).astype(np.float32)
            message = Voice(opus=self._encoder.encode(pcm), talking=talking, level_db=-20.0)
            message.header.t_ns = self.now_ns
            if k not in lost:
                self.listener.reader.push(message, self.now_ns)
            self.now_ns += FRAME_NS
            if not at_once:
                self.listener.round((), self.now_ns)
        self.listener.round((), self.now_ns + BEHIND_NS)
        told, self._told.utterances = self._told.utterances, []
        self.said_ns = told[-1].start_ns if told else 0
        return [Utterance.State.Name(u.state).removeprefix("STATE_") for u in told]


@in_a_loop
def test_a_sentence_is_done() -> None:
    assert Person().hears() == ["SENT"]


@in_a_loop
def test_a_recogniser_that_fails_is_named_rests_and_is_used_again(caplog: pytest.LogCaptureFixture) -> None:
    ann = Person()
    feed, faults = ann.recogniser.feed, [RuntimeError("no such state"), MemoryError()]

    def fails(samples: Samples) -> list[Hypotheses]:
        if faults:
            raise faults.pop()
        return feed(samples)

    ann.recogniser.feed = fails  # type: ignore[method-assign]
    assert ann.hears(1.0) == []
    assert len(faults) == 1  # it was left alone after the first fault
    assert ann.hears(REST_NS * 1e-9) == []
    assert not faults
    assert ann.hears(REST_NS * 1e-9 + 1.4) == ["SENT"]
    named = [r.getMessage() for r in caplog.records if "recogniser_failed" in r.getMessage()]
    assert len(named) == 2
    assert "MemoryError" in named[0] and "no such state" in named[1]


@in_a_loop
def test_what_is_no_louder_than_the_noise_is_no_sentence_however_sure_its_recogniser_is() -> None:
    assert Person(confidence=1.0).hears(talking=False) == []


@in_a_loop
def test_a_sentence_of_which_pieces_never_came_is_not_done() -> None:
    assert Person(confidence=1.0).hears(lost=range(15, 25)) == ["REJECTED"]
    assert Person(confidence=1.0).hears(lost=[20]) == ["SENT"]


@in_a_loop
def test_a_single_word_needs_more_belief_where_the_microphone_is_open_and_is_asked_back() -> None:
    assert Person(PUSH, 0.6).hears() == ["QUESTION"]
    assert Person(PUSH, 0.8).hears() == ["SENT"]
    assert Person(MOVE, 0.6).hears() == ["SENT"]


@in_a_loop
def test_where_people_say_when_they_speak_a_single_word_needs_no_more() -> None:
    person = Person(PUSH, 0.6, "push")
    person.listener.set_control(VoiceControl(talk=True), (), person.now_ns)
    assert person.hears() == ["SENT"]


@in_a_loop
def test_what_the_room_itself_says_is_not_heard() -> None:
    assert Person(replies=True).hears() == []


@in_a_loop
def test_the_same_words_at_two_microphones_are_done_once() -> None:
    echoes = Told()
    ann, bob = (Person(name=name, echoes=echoes) for name in ("ann", "bob"))
    assert ann.hears() == ["SENT"]
    bob.now_ns += 200_000_000  # through the loudspeaker
    assert bob.hears() == []
    bob.now_ns += 3_000_000_000
    assert bob.hears() == ["SENT"], "later, he says so himself"


@in_a_loop
def test_what_is_cut_off_by_muting_is_not_done_and_nothing_is_heard_while_muted() -> None:
    person = Person()
    person.hears(0.8)
    person.listener.set_control(VoiceControl(muted=True), (), person.now_ns)
    assert person.hears(1.4) == []
    person.listener.set_control(VoiceControl(), (), person.now_ns)
    assert person.hears(1.4) == ["SENT"]


def test_a_service_that_was_kept_from_listening_hears_every_sample_all_the_same() -> None:
    """Under load rounds are late: skipping what came meanwhile would leave "おして" of "もとにもどして"."""

    def sound(every: int) -> np.ndarray:
        reader, encoder = VoiceReader(), Encoder(1, 24_000)
        rng = np.random.default_rng(1)
        out: list[np.ndarray] = []
        for k in range(100):
            message = Voice(opus=encoder.encode(rng.uniform(-0.3, 0.3, FRAME).astype(np.float32)), talking=True)
            message.header.t_ns = START_NS + k * FRAME_NS
            reader.push(message, message.header.t_ns)
            if k == 0 or k % every == every - 1:
                out += [p.sound for p in reader.read(START_NS + (k + 1) * FRAME_NS)]
        return np.concatenate(out)

    steady, late = sound(1), sound(15)
    count = min(len(steady), len(late))
    assert count > 16_000
    assert np.array_equal(steady[:count], late[:count])


@pytest.mark.parametrize("late_ms", [30, 53, 67, 190])
def test_frames_that_all_come_late_are_waited_for(late_ms: int) -> None:
    """A microphone may hold sound back, and so may a busy capture: 50 ms were enough to lose nearly all of somebody's words."""
    reader, encoder = VoiceReader(), Encoder(1, 24_000)
    t = np.arange(FRAME) / RATE
    heard = 0
    for k in range(100):
        message = Voice(opus=encoder.encode((0.2 * np.sin(2 * np.pi * 220.0 * t)).astype(np.float32)), talking=True)
        message.header.t_ns = START_NS + k * FRAME_NS
        now_ns = message.header.t_ns + late_ms * 1_000_000 + (k % 3) * 5_000_000
        reader.push(message, now_ns)
        heard += sum(len(p.sound) for p in reader.read(now_ns + 7_000_000))
    assert heard > 24_000
    assert reader.reception(START_NS, START_NS + 100 * FRAME_NS).lost <= 0.04


def test_an_hour_in_which_nobody_listened_is_not_caught_up_with() -> None:
    reader = VoiceReader()
    assert list(reader.read(START_NS)) == []
    assert list(reader.read(START_NS + 3_600_000_000_000)) == []
    assert reader.resting


@in_a_loop
def test_time_is_counted_from_when_the_button_was_pressed() -> None:
    person = Person(listen="push")
    person.hears(2.0)
    person.listener.set_control(VoiceControl(talk=True), (), person.now_ns)
    pressed_ns = person.now_ns
    assert person.hears(1.4) == ["SENT"]
    assert pressed_ns + 50_000_000 < person.said_ns < pressed_ns + 300_000_000
