"""What a guest's page plays, in a real browser: a voice sounds when its picture is seen, also after the page was held up."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import numpy as np
import pytest
from browser import page
from guest_room import GuestRoom

from vistel.arrays import F64
from vistel_services.console import bundle

FLAGS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
FLAGS += ("--autoplay-policy=no-user-gesture-required",)
SKEW_MS = 45.0
"""A voice after its lips or before them, on a machine that may be busy."""
DELAY_MS, STALLED_MS, SECONDS = 150.0, 600.0, 9.0
STALL_S, OVER_S = 4.0, 5.6
"""When the page is held up, and when what it plays has to be in time again."""
# A voice that arrives as from the gateway, 30 to 70 ms after its capture, and what is heard, in steps of 2 ms.
PLAY = """(async (bursts, delay, seconds, stallAt, stalled) => {
  const { voices } = window.guest, rate = 48000, packets = [];
  voices.turn(true);
  const context = voices.output.context;
  await context.resume();
  await context.audioWorklet.addModule("microphone.js"); // the policy of the page lets no other in
  const node = new AudioWorkletNode(context, "microphone", { numberOfOutputs: 0, channelCount: 1, channelCountMode: "explicit" });
  const heard = [], clock = [];
  node.port.onmessage = ({ data: { end, block } }) => {
    for (let at = 0; at < 480; at += 96) {
      const square = block.subarray(at, at + 96).reduce((s, x) => s + x * x, 0) / 96;
      heard.push([(end - (480 - at - 48) / rate) * 1000, Math.sqrt(square)]);
    }
  };
  voices.output.connect(node);
  const encoder = new AudioEncoder({ error: console.error, output: (chunk) => {
    const opus = new Uint8Array(chunk.byteLength);
    chunk.copyTo(opus);
    packets.push(opus);
  } });
  encoder.configure({ codec: "opus", sampleRate: rate, numberOfChannels: 1, bitrate: 24000, opus: { frameDuration: 20000 } });
  const loud = (s) => bursts.some(([from, to]) => s >= from && s < to);
  for (let n = 0; n < seconds * 50; n++) {
    const data = Float32Array.from({ length: 960 }, (_, i) => loud(n / 50 + i / rate) * 0.4 * Math.sin((n * 960 + i) * 0.06));
    const frame = { format: "f32-planar", sampleRate: rate, numberOfFrames: 960, numberOfChannels: 1, timestamp: n * 20000, data };
    encoder.encode(new AudioData(frame));
  }
  await encoder.flush();
  const arrives = packets.map((_, n) => n * 20 + 30 + ((n * 37) % 41));
  const begun = performance.now() + 200;
  let at = 0, held = false;
  await new Promise((done) => {
    const step = setInterval(() => {
      const now = performance.now();
      voices.frame(now, 0);
      const { contextTime, performanceTime } = context.getOutputTimestamp();
      clock.push(contextTime * 1000 - performanceTime);
      if (!held && now - begun > stallAt * 1000) {
        held = true;
        while (performance.now() < now + stalled);
      }
      for (; at < packets.length && begun + arrives[at] <= performance.now(); at++) {
        const message = new Uint8Array(1 + 17 + packets[at].length), view = new DataView(message.buffer);
        message[0] = 2;
        view.setUint16(1, message.length - 1, true);
        view.setUint8(3, 1);
        view.setFloat64(5, begun + at * 20 - 6.5, true);
        view.setFloat32(13, delay, true);
        message[17] = 97;
        message.set(packets[at], 18);
        voices.take(message.buffer);
      }
      if (at === packets.length) (clearInterval(step), setTimeout(done, 500));
    }, 5);
  });
  clock.sort((a, b) => a - b);
  return { begun, heard, offset: clock[clock.length >> 1] };
})"""


def bursts(seconds: float) -> list[tuple[float, float]]:
    """Irregular, so that what is heard tells when it was said."""
    rng, at, out = np.random.default_rng(5), 0.2, list[tuple[float, float]]()
    while at < seconds - 0.5:
        long = rng.uniform(0.1, 0.35)
        out.append((at, at + long))
        at += long + rng.uniform(0.1, 0.35)
    return out


def skew(times_s: F64, levels: F64, said: list[tuple[float, float]], begin_s: float, end_s: float) -> tuple[float, float]:
    """How much later than `said` a voice is heard within a part of it [ms], and how alike the two are then (correlation)."""
    grid = np.arange(begin_s, end_s, 0.002)
    wanted = np.array([any(a <= t < b for a, b in said) for t in grid], float)
    found = [
        (np.corrcoef(np.interp(grid + shift, times_s, levels), wanted)[0, 1], shift * 1e3) for shift in np.arange(-0.4, 1.2, 0.002)
    ]
    alike, late_ms = max(found)
    return float(late_ms), float(alike)


@pytest.mark.alone
def test_a_voice_is_heard_when_its_picture_is_seen_also_after_the_page_was_held_up(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if not (bundle.FOLDER / bundle.MICROPHONE_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")

    async def visit() -> None:
        async with page(tmp_path, *FLAGS) as tab, GuestRoom(tmp_path).serving(monkeypatch) as room:
            await tab.open(f"http://{room.address}/join#{room.invited()}", 560, 640)
            await tab.until("document.documentElement.dataset.begun")
            if not await tab.value("Boolean(window.guest)"):
                pytest.skip("this Chromium has no WebGL")
            await tab.value("(window.requestAnimationFrame = () => 0) && 1")  # sound, not pictures, is measured
            said = bursts(SECONDS)
            given = ", ".join(map(json.dumps, (said, DELAY_MS, SECONDS, STALL_S, STALLED_MS)))
            out = await tab.value(f"{PLAY}({given})")
            heard = np.array(out["heard"])
            times_s = (heard[:, 0] - out["offset"] - out["begun"] - DELAY_MS) / 1e3
            before, after = (skew(times_s, heard[:, 1], said, *part) for part in ((1.0, STALL_S), (OVER_S, SECONDS)))
            assert min(before[1], after[1]) > 0.8, (before, after)
            assert max(abs(before[0]), abs(after[0])) < SKEW_MS, (before, after)

    asyncio.run(visit())
