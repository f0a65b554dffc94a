"""Speech for pages, and what they are heard to play."""

from __future__ import annotations

import numpy as np
from guest_room import GuestPage, GuestRoom

from vistel.arrays import F32
from vistel.audio.opus import FRAME, FRAME_NS, RATE, Encoder
from vistel.audio.page_voice import voice_record

LISTEN = """(async () => {
  const { voices } = window.guest, context = voices.output.context;
  await context.audioWorklet.addModule("microphone.js"); // the policy of the page lets no other in
  const node = new AudioWorkletNode(context, "microphone", { numberOfOutputs: 0, channelCount: 1, channelCountMode: "explicit" });
  const { port1, port2 } = new MessageChannel(), levels = [], clock = [];
  node.port.postMessage(port1, [port1]);
  port2.onmessage = ({ data: { end, block } }) => {
    const { contextTime, performanceTime } = context.getOutputTimestamp();
    clock.push(contextTime * 1000 - performanceTime);
    for (let at = 0; at < 480; at += 96) {
      const square = block.subarray(at, at + 96).reduce((s, x) => s + x * x, 0) / 96;
      levels.push([end * 1000 - (480 - at - 48) / 48, Math.sqrt(square)]);
    }
  };
  voices.output.connect(node);
  window.heard = () => {
    const later = [...clock].sort((a, b) => a - b)[clock.length >> 1];
    return levels.map(([ms, level]) => [ms - later, level]);
  };
  return true;
})()"""
"""JavaScript: from now on `heard()` gives what the page plays, each 2 ms: [performance.now(), level]."""


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


def envelope(sound: F32, step: int = 480) -> F32:
    """Loudness in steps of so many samples."""
    steps = sound[: len(sound) // step * step].reshape(-1, step)
    return np.sqrt((steps**2).mean(axis=1))


async def speak(room: GuestRoom, visit: GuestPage, sound: F32) -> int:
    """As a page's microphone does, in real time. Returns when the first sample was captured, conference time [ns]."""
    encoder, begun_ns = Encoder(), room.clock.now_ns()
    for n in range(len(sound) // FRAME):
        await room.clock.sleep_until_ns(begun_ns + (n + 1) * FRAME_NS)
        packet = encoder.encode(sound[n * FRAME : (n + 1) * FRAME])
        await visit.socket.send_bytes(voice_record(begun_ns + n * FRAME_NS - encoder.lookahead_ns, packet))
    return begun_ns
