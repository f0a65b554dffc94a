"""A real sound card, as far as PortAudio can tell: what PulseAudio plays into a null sink is heard by its monitor.

Skipped where PulseAudio is not installed (`apt-get install pulseaudio libasound2-plugins`). Runs in a process of its own,
which alone is told of the server.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from null_sink import environment_of, needs_pulseaudio, server

pytestmark = [pytest.mark.alone, pytest.mark.slow, needs_pulseaudio]

LOOP = """
import json, sys, time
import numpy as np
from vistel.audio.opus import FRAME, FRAME_NS, RATE
from vistel.wire.clock import SystemClock
from vistel.audio.capture import MicrophoneCapture
from vistel_services.audio.inputs import InputOpener
from vistel_services.audio.outputs import Loudspeaker
from vistel_sim.microphone import clap

clock, sound = SystemClock(), clap()
loudspeaker, capture = Loudspeaker("default", clock), MicrophoneCapture("ann", InputOpener("default", clock))
state = "", ""
count, frames, played, waiting, over = 0, [], [], np.zeros(0, np.float32), time.monotonic() + float(sys.argv[1])
while time.monotonic() < over:
    now_ns = clock.now_ns()
    while (due_ns := loudspeaker.due(now_ns)) is not None:
        block = np.zeros(FRAME, np.float32)
        if count % 25 == 12:
            played.append((due_ns, loudspeaker.about))
            waiting = sound
        part = waiting[:FRAME]
        block[: len(part)], waiting = part, waiting[FRAME:]
        loudspeaker.put(np.stack((block, block), 1))
        count += 1
    frames += capture.frames(now_ns)
    if (loudspeaker.detail, capture.detail) != state:
        state = loudspeaker.detail, capture.detail
        print(json.dumps({"loudspeaker": state[0], "microphone": state[1]}), flush=True)
    time.sleep(0.01)  # a sound card plays in real time
begin_ns = frames[0][0]
heard = np.zeros(round((frames[-1][0] - begin_ns) / FRAME_NS + 1) * FRAME)
for t_ns, pcm in frames:
    at = round((t_ns - begin_ns) / FRAME_NS) * FRAME
    heard[at : at + FRAME] = pcm
late_ms = []
for due_ns, about in played:
    at = round((due_ns - begin_ns) * 1e-9 * RATE)
    part = heard[max(0, at - RATE // 5) : at + RATE // 5]
    match = np.abs(np.correlate(part, sound, "valid")) if about != "none" and len(part) > len(sound) else np.zeros(1)
    if match.max() > 0.5 * float(sound @ sound):
        late_ms.append((max(0, at - RATE // 5) + int(np.argmax(match)) - at) / RATE * 1e3)
print(json.dumps({"late_ms": late_ms}), flush=True)
loudspeaker.close()
capture.close()
"""


def test_claps_are_heard_when_they_were_played_and_a_card_that_goes_is_named_and_comes_back(tmp_path: Path) -> None:
    environment = environment_of(tmp_path)
    pulse = server(tmp_path, environment)
    loop = subprocess.Popen([sys.executable, "-c", LOOP, "14"], env=environment, stdout=subprocess.PIPE, text=True)
    try:
        time.sleep(5.0)  # of sound
        pulse.send_signal(signal.SIGKILL)
        pulse.wait()
        time.sleep(1.0)  # without a card
        pulse = server(tmp_path, environment)
        output, _ = loop.communicate(timeout=600)
    finally:
        loop.kill()
        pulse.kill()
        pulse.wait()
    told: list[dict[str, Any]] = [json.loads(line) for line in output.splitlines()]
    if any("no sound card" in t.get("loudspeaker", "") for t in told[:1]):
        pytest.skip("PortAudio does not see PulseAudio: apt-get install libportaudio2 libasound2-plugins")
    states = told[:-1]
    lost = [i for i, t in enumerate(states) if t["loudspeaker"] and t["microphone"]]
    assert lost, "the card that went was not named"
    assert states[-1] == {"loudspeaker": "", "microphone": ""}, "the card that came back was not used"
    late_ms = told[-1]["late_ms"]
    assert len(late_ms) >= 6
    assert abs(sorted(late_ms)[len(late_ms) // 2]) < 30.0
