"""Somebody speaks to the room: microphone, voice service, recogniser, world and what everybody is told, in simulated time."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from world_site import START_NS, WorldSite

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.speech.synthesis import voices
from vistel.v1.audio_pb2 import VoiceControl
from vistel.v1.speech_pb2 import Utterance
from vistel.wire.topics import BY_NAME
from vistel_services import audio, speech
from vistel_services.speech import replies
from vistel_sim.microphone import SimulatedMicrophone, SimulatedVoice, run_microphones
from vistel_sim.sentences import Sentences

needs_a_voice = pytest.mark.skipif("espeak-ng" not in voices(), reason="espeak-ng is not installed")


def conference(language: str = "en", **keys: Any) -> Conference:
    return Conference.model_validate(
        {
            "sites": [
                {
                    "name": "tokyo",
                    "participants": [{"name": "aiko"}],
                    "audio": {"loudspeaker": "none", "stream": False},
                    "speech": {"language": language, **keys},
                },
                {"name": "paris", "participants": [{"name": "bruno"}]},
                {"name": "lagos", "participants": [{"name": "chidi"}]},
            ]
        }
    )


class Talk:
    """aiko at tokyo says `sentences` from four seconds on; the world goes on with her motion."""

    def __init__(self, folder: Path, sentences: Sequence[str], setting: Conference | None = None) -> None:
        self.site = WorldSite(folder)
        self.conference = setting or conference()
        paths = RunPaths(folder / "run", folder / "out")
        here = self.conference.sites[0]
        self._audio = audio.configure(self.conference, here, paths)
        self._speech = speech.configure(self.conference, here, paths)
        voice = SimulatedVoice(lambda t: 0.0, lambda a, b: (), 5, Sentences(sentences))
        self._microphone = SimulatedMicrophone("aiko-microphone", voice, paths.device("aiko-microphone"))
        self.utterances: list[Utterance] = []

    def run(self, seconds: float, at: dict[float, Callable[[Talk], None]] | None = None) -> Talk:
        asyncio.run(self._run(seconds, at or {}))
        return self

    async def _run(self, seconds: float, at: dict[float, Callable[[Talk], None]]) -> None:
        async with self.site.open():
            clock = self.site.clock
            bus = self.bus = self.site.network.bus("demo", "tokyo", clock)
            told = bus.subscribe(BY_NAME["utterance"])
            self._microphone.put(-1)  # plugged in before the service looks
            listening = asyncio.create_task(speech.run(self._speech, bus, clock))
            before = len(clock._sleepers)
            while len(clock._sleepers) == before and not listening.done():
                await asyncio.sleep(0.01)  # its models are loaded on a thread
            tasks = [
                asyncio.create_task(audio.run(self._audio, bus, clock)),
                listening,
                asyncio.create_task(run_microphones([self._microphone], clock, clock.now_ns())),
            ]
            try:
                for n in range(round(seconds * 5)):
                    for when in [w for w in at if w <= n / 5]:
                        at.pop(when)(self)
                    await self.site.play(0.2)
                    self.utterances += [s.message for s in told.take()]
                    for task in tasks:
                        if task.done():
                            task.result()
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)

    @property
    def states(self) -> list[str]:
        return [Utterance.State.Name(u.state).removeprefix("STATE_") for u in self.utterances]


@needs_a_voice
def test_a_spoken_command_moves_the_box_and_everybody_sees_it(tmp_path: Path) -> None:
    talk = Talk(tmp_path, ["move the blue box to the right"]).run(8.0)
    assert talk.states == ["SENT", "DONE"]
    done = talk.utterances[-1]
    assert (done.text, done.language, done.participant) == ("move the blue box to the right", "en", "aiko")
    assert (list(done.things), done.reply) == (["box"], "done")
    assert START_NS + 3_900_000_000 < done.start_ns < done.end_ns < START_NS + 7_000_000_000
    rooms = talk.site.rooms()
    way = rooms[-1].poses["box"][0] - rooms[0].poses["box"][0]
    assert np.linalg.norm(way[[0, 2]]) == pytest.approx(0.1, abs=0.03)


@needs_a_voice
def test_what_the_world_refuses_is_answered_to_who_spoke(tmp_path: Path) -> None:
    talk = Talk(tmp_path, ["make the red ring larger"]).run(7.6)
    assert talk.states == ["SENT", "REFUSED"]
    assert "there is no red ring" in talk.utterances[-1].reply


@needs_a_voice
def test_with_push_to_talk_only_what_is_said_while_the_button_is_held_is_heard(tmp_path: Path) -> None:
    def press(held: bool) -> Callable[[Talk], None]:
        def put(talk: Talk) -> None:
            control = VoiceControl(participant="aiko", talk=held)
            talk.bus.publish(BY_NAME["voice_control"], participant="aiko").put(control)

        return put

    said = ["delete the blue box", "make the red ring larger"]
    talk = Talk(tmp_path, said, conference(listen="push")).run(14.0, {9.0: press(True), 13.0: press(False)})
    assert [u.text for u in talk.utterances] == ["make the red ring larger"] * 2
    assert "box" in talk.site.rooms()[-1].things


def test_a_language_without_its_recogniser_is_named_and_the_site_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setitem(sys.modules, "pocketsphinx", None)
    talk = Talk(tmp_path, []).run(0.4)
    assert talk.utterances == []
    assert "pocketsphinx: its package is not installed (pip install pocketsphinx==5.1.1)" in caplog.text


@needs_a_voice
def test_japanese_moves_the_box_as_well(tmp_path: Path) -> None:
    talk = Talk(tmp_path, ["あおいはこをみぎにうごかして"], conference("ja")).run(8.0)
    assert talk.states == ["SENT", "DONE"]
    assert talk.utterances[-1].text.replace("を", "") == "青い箱右に動かして"
    assert talk.utterances[-1].reply == "はい"
    assert list(talk.utterances[-1].things) == ["box"]


def test_words_of_a_conference_that_cannot_be_recognised_are_named_and_the_rest_is_listened_for(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    own = tmp_path / "own.toml"
    own.write_text('[classes.verb]\npet = { kana = ["xyz"], en = ["qzxv"], means = { do = "select" } }\n', "utf-8")
    with caplog.at_level("INFO", "vistel.speech"):
        talk = Talk(tmp_path, [], conference("ja", grammar=[str(own)])).run(0.4)
    assert talk.utterances == []
    assert f"event=grammar_fault at={own}:2" in caplog.text
    assert "event=listening participant=aiko" in caplog.text


@needs_a_voice
@pytest.mark.parametrize("installed", [True, False])
def test_a_sentence_after_the_wake_word_is_done_and_answered_aloud_where_espeak_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, installed: bool
) -> None:
    if not installed:
        monkeypatch.setattr(replies, "voices", lambda: ())
    said = ["いたをかくして", "こんぴゅーたいたをかくして"]
    aloud: list[Any] = []
    listening: list[Any] = []

    def listen(talk: Talk) -> None:
        listening.append(talk.bus.subscribe(BY_NAME["spoken_reply"], queue_all=True))

    def count(talk: Talk) -> None:
        aloud.extend(s for s in listening[0].take() if s.message.opus)

    talk = Talk(tmp_path, said, conference("ja", listen="wake", reply="spoken")).run(15.0, {1.0: listen, 14.6: count})
    assert talk.states == ["SENT", "DONE"], "without the wake word nothing is said to the room"
    assert talk.utterances[0].start_ns > START_NS + 9_000_000_000
    assert (list(talk.utterances[-1].things), talk.utterances[-1].reply) == (["tile"], "はい")
    assert talk.site.rooms()[-1].things["tile"].hidden
    assert bool(aloud) == installed
