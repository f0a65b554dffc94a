"""Sound of the page for guests in a real browser: who speaks there is heard at a site, and who speaks elsewhere is heard there.

All services share one event loop here, which is late by seconds on a busy machine: how well in time a page plays is measured in
test_guest_hearing.py.
"""

from __future__ import annotations

import asyncio
import contextlib
import wave
from pathlib import Path

import numpy as np
import pytest
from browser import page
from guest_room import GuestPage, GuestRoom

from vistel.arrays import F32
from vistel.audio.opus import FRAME, FRAME_NS, RATE, Decoder, Encoder
from vistel.audio.page_voice import voice_record
from vistel_services import audio
from vistel_services.console import bundle

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
LOUD, QUIET = 0.01, 0.001
# What the page hears, each 10 ms: [performance.now(), level].
TAP = """(() => {
  const { voices } = window.guest, block = new Float32Array(1024);
  const analyser = new AnalyserNode(voices.output.context, { fftSize: 1024 });
  voices.output.connect(analyser);
  window.tapped = [];
  setInterval(() => {
    analyser.getFloatTimeDomainData(block);
    window.tapped.push([performance.now(), Math.sqrt(block.reduce((s, x) => s + x * x, 0) / 1024)]);
  }, 10);
  return true;
})()"""


def talk(seed: int, seconds: float) -> F32:
    """Syllables and pauses of irregular length: a voice's envelope, which only itself matches."""
    rng, out = np.random.default_rng(seed), np.zeros(int(seconds * RATE), np.float32)
    at = RATE // 4
    while at < len(out) - RATE:
        long = int(rng.uniform(0.15, 0.5) * RATE)
        t = np.arange(long) / RATE
        tone = sum(np.sin(2 * np.pi * k * rng.uniform(110, 150) * t + rng.uniform(0, 6)) / k for k in range(1, 16))
        out[at : at + long] = 0.15 * tone * np.hanning(long) ** 0.3
        at += long + int(rng.uniform(0.15, 0.7) * RATE)
    return out


def envelope(sound: F32) -> F32:
    """Loudness in steps of 10 ms."""
    steps = sound[: len(sound) // 480 * 480].reshape(-1, 480)
    return np.sqrt((steps**2).mean(axis=1))


async def speak(room: GuestRoom, visit: GuestPage, sound: F32) -> None:
    """As a page's microphone does, in real time."""
    encoder, begun_ns = Encoder(), room.clock.now_ns()
    for n in range(len(sound) // FRAME):
        await room.clock.sleep_until_ns(begun_ns + (n + 1) * FRAME_NS)
        packet = encoder.encode(sound[n * FRAME : (n + 1) * FRAME])
        await visit.socket.send_bytes(voice_record(begun_ns + n * FRAME_NS - encoder.lookahead_ns, packet))


@pytest.mark.alone
def test_who_speaks_at_the_page_is_heard_at_a_site_and_who_speaks_elsewhere_is_heard_at_the_page(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if not (bundle.FOLDER / bundle.MICROPHONE_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")
    ann, bob = talk(1, 12.0), talk(2, 7.0)
    with wave.open(str(tmp_path / "ann.wav"), "wb") as file:
        file.setparams((1, 2, RATE, 0, "NONE", ""))
        file.writeframes((ann * 32767).astype("<i2").tobytes())
    fake = ("--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream")
    fake += (f"--use-file-for-fake-audio-capture={tmp_path / 'ann.wav'}",)
    hall = {"name": "hall", "participants": [{"name": "hanna"}]}
    hall["audio"] = {"microphone": "none", "loudspeaker": "heard.wav", "spatial": "off"}

    async def visit() -> None:
        async with (
            page(tmp_path, *SOFTWARE_GL, *fake) as tab,
            GuestRoom(tmp_path, None, hall).serving(monkeypatch) as room,
            room.opened(room.invited("guest-2", "Bob")) as other,
        ):
            site = room.conference.sites[1]
            config = audio.configure(room.conference, site, room.paths)
            listening = asyncio.create_task(audio.run(config, room.network.bus("c", "hall", room.clock), room.clock))
            await other.enter("ben")
            await tab.open(f"http://{room.address}/join#{room.invited()}", 560, 640)
            await tab.until("document.documentElement.dataset.begun")
            if not await tab.value("Boolean(window.guest)"):
                pytest.skip("this Chromium has no WebGL")
            await tab.until("!document.getElementById('door').hidden")
            # Nothing is drawn: on a busy machine without a graphics card that would leave the page no time for sound.
            await tab.value("(window.requestAnimationFrame = () => 0) && 1")
            await tab.click("#microphone")
            await tab.until("window.guest.microphone.state === 'on'")
            assert not room.spoken  # nothing is sent before the guest is in the room
            await tab.click(".people button[aria-current=true]")
            await tab.until("window.guest.me() === 'guest-1' && window.guest.joints('guest-2').length > 0")
            await tab.until("window.guest.ready() >= 2")  # what takes long is done
            assert await tab.value(TAP)
            await room.until(lambda: sum(name == "guest-1" and bool(m.opus) for name, m in room.spoken) > 50, "the page's voice")
            alone = np.array(await tab.value("window.tapped"))[:, 1]
            await speak(room, other, bob)
            await tab.until("window.tapped.filter(([, level]) => level > 0.003).length > 50")
            room.take()
            listening.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await listening
            assert alone.max() < QUIET  # the page does not play its own guest, who speaks
            decoder = Decoder()
            said = np.concatenate([decoder.decode(m.opus) for name, m in room.spoken if name == "guest-1" and m.opus])
            assert (envelope(said) > LOUD).mean() > 0.3, "what the page sends is no voice"
            with wave.open(str(tmp_path / "heard.wav")) as file:
                played = np.frombuffer(file.readframes(file.getnframes()), "<i2").astype(np.float32).reshape(-1, 2)[:, 0] / 32767
            assert (envelope(played) > LOUD).sum() > 50, "less than half a second is heard at the site"

    asyncio.run(visit())
