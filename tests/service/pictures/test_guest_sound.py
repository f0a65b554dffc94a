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
from guest_room import GuestRoom, at_the_door
from page_speech import LISTEN, envelope, speak, talk

from vistel.audio.opus import RATE, Decoder
from vistel_services import audio
from vistel_services.console import bundle

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
LOUD, QUIET = 0.01, 0.001


@pytest.mark.alone
def test_who_speaks_at_the_page_is_heard_at_a_site_and_who_speaks_elsewhere_is_heard_at_the_page(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
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
            contextlib.AsyncExitStack() as there,
        ):
            site = room.conference.sites[1]
            config = audio.configure(room.conference, site, room.paths)
            listening = asyncio.create_task(audio.run(config, room.network.bus("c", "hall", room.clock), room.clock))
            await other.enter("ben")
            await there.enter_async_context(other.listening())
            await at_the_door(tab, room, room.invited(), 560, 640)
            await tab.click("#microphone")
            await tab.until("window.guest.microphone.state === 'on'")
            assert not room.spoken  # nothing is sent before the guest is in the room
            await tab.click(".people button[aria-current=true]")
            await tab.until("window.guest.me() === 'guest-1' && window.guest.joints('guest-2').length > 0")
            await tab.until("window.guest.ready() >= 2")  # what takes long is done
            # Nothing is drawn from now on: on a busy machine without a graphics card that would leave the page no time for sound.
            await tab.value("(window.requestAnimationFrame = () => 0) && 1")
            await tab.until("Boolean(window.guest.voices.output)")
            assert await tab.value(LISTEN)
            await room.until(lambda: sum(name == "guest-1" and bool(m.opus) for name, m in room.spoken) > 50, "the page's voice")
            await tab.until("window.heard().length > 250")  # half a second of what the page plays meanwhile
            alone = np.array(await tab.value("window.heard()"))[:, 1]
            await speak(room, other, bob)
            await tab.until("window.heard().filter(([, level]) => level > 0.003).length > 250")
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
