"""Sound of the page for guests in a real browser: who speaks there is heard at a site, and a voice is heard there with its lips."""

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
EARLIEST_MS, LATEST_MS = -15.0, 45.0
"""A voice after its lips."""
BUSY_MS = 40.0
"""Where the event loop is later, sound in time cannot be expected."""
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


def likeness(heard: F32, said: F32) -> float:
    """Highest correlation of two envelopes over all shifts, of a part of `said` as long as what was heard at the most."""
    a, b = (x - x.mean() for x in (np.sqrt(heard), np.sqrt(said)))
    if len(a) < len(b):
        a, b = b, a
    norms = np.sqrt(np.convolve(a**2, np.ones(len(b)), "valid")) * np.linalg.norm(b)
    return float((np.correlate(a, b, "valid") / np.maximum(norms, 1e-9)).max())


async def speak(room: GuestRoom, visit: GuestPage, sound: F32) -> float:
    """As a page's microphone does, in real time. Returns how late this event loop was, 95 % of the time [ms]."""
    encoder, begun_ns = Encoder(), room.clock.now_ns()
    late_ns: list[int] = []
    for n in range(len(sound) // FRAME):
        await room.clock.sleep_until_ns(begun_ns + (n + 1) * FRAME_NS)
        late_ns.append(room.clock.now_ns() - begun_ns - (n + 1) * FRAME_NS)
        packet = encoder.encode(sound[n * FRAME : (n + 1) * FRAME])
        await visit.socket.send_bytes(voice_record(begun_ns + n * FRAME_NS - encoder.lookahead_ns, packet))
    return float(np.percentile(late_ns, 95)) * 1e-6


@pytest.mark.alone
def test_who_speaks_at_the_page_is_heard_at_a_site_and_who_speaks_elsewhere_is_heard_there_with_their_lips(
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
            late_ms = await speak(room, other, bob)
            tapped = np.array(await tab.value("window.tapped"))
            skews = np.array(await tab.value("window.guest.voices.skews"))
            room.take()
            own = [m for name, m in room.spoken if name == "guest-1"]
            listening.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await listening
            grid = np.arange(tapped[0, 0], tapped[-1, 0], 10.0)
            heard = np.interp(grid, tapped[:, 0], tapped[:, 1])
            said = [(m.header.t_ns, m.opus) for m in own if m.opus]
            decoder, at_site = Decoder(), np.zeros(round((said[-1][0] - said[0][0]) / 1e9 * RATE) + 2 * FRAME, np.float32)
            for t_ns, opus in said:
                begin = round((t_ns - said[0][0]) / 1e9 * RATE)
                at_site[begin : begin + FRAME] = decoder.decode(opus)
            with wave.open(str(tmp_path / "heard.wav")) as file:
                played = np.frombuffer(file.readframes(file.getnframes()), "<i2").astype(np.float32).reshape(-1, 2)[:, 0] / 32767
            print("skews", np.percentile(skews,[5,50,95]), len(skews), "late", late_ms, "played", likeness(envelope(played), envelope(at_site)), "uplink", likeness(envelope(at_site), envelope(np.tile(ann,3))), "heard", likeness(heard, envelope(bob)), len(said), len(own), len(tapped))
            assert np.abs(played).max() > 0.01 and heard.max() > 0.003
            if late_ms > BUSY_MS:
                pytest.skip(f"heard both ways; this machine is too busy to tell how well: late by {late_ms:.0f} ms")
            assert likeness(envelope(played), envelope(at_site)) > 0.6
            assert likeness(envelope(at_site), envelope(np.tile(ann, 3))) > 0.7
            assert likeness(heard, envelope(bob)) > 0.75
            assert np.percentile(skews, 5) >= EARLIEST_MS and np.percentile(skews, 95) <= LATEST_MS, skews

    asyncio.run(visit())
