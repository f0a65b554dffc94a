"""Everything a voice goes through, a delay unit on Modbus included: what leaves the unit's delay line is as late as the picture."""

from __future__ import annotations

import asyncio
import math
import wave
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import virtual_time

from vistel.audio.opus import RATE
from vistel.protocol.equipment import DELAY_UNIT
from vistel.v1.audio_pb2 import SoundStatus
from vistel.v1.service_pb2 import ImageDelay
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services.audio import Config, Microphone
from vistel_services.audio import run as run_audio
from vistel_services.delay import Config as RoomConfig
from vistel_services.delay import Device
from vistel_services.delay import run as run_room
from vistel_sim.equipment.delay_unit import SimulatedDelayUnit
from vistel_sim.microphone import SimulatedMicrophone, SimulatedVoice, clap, run_microphones

EVERY_S = 0.7
IMAGE_S, SECONDS = 0.26, 14.0
PHASE_S = 0.018
"""Of the microphone's blocks against the rounds in which they are read: what was written is seen 2 ms later."""


def claps(start_s: float, end_s: float) -> Sequence[float]:
    return [k * EVERY_S for k in range(math.ceil(start_s / EVERY_S), math.ceil(end_s / EVERY_S)) if k >= 0]


@pytest.mark.parametrize("baud", [0, 38400], ids=["tcp", "rtu"])
def test_a_clap_leaves_the_delay_unit_with_its_picture(tmp_path: Path, baud: int) -> None:
    asked: list[float] = []
    status = SoundStatus()

    async def main() -> SimulatedDelayUnit:
        clock = virtual_time.LoopClock()
        start_ns = clock.now_ns() + round(PHASE_S * 1e9)
        network = MemoryNetwork()
        tokyo, oslo = (network.bus("c", site, clock) for site in ("tokyo", "oslo"))
        microphone = SimulatedMicrophone("mic", SimulatedVoice(lambda t: 0.0, claps, 1), tmp_path / "mic")
        microphone.put(-1)
        unit = SimulatedDelayUnit("unit", tmp_path / "unit", clock, start_ns, baud=baud)
        device = Device("unit", "sim", tmp_path / "unit", 1, DELAY_UNIT, baud or 19200, delay_channel=1)
        mine = Config("tokyo", "ann", (Microphone("ann", str(tmp_path / "mic")),), stream=False, spatial="off")
        theirs = Config("oslo", "bob", (), str(tmp_path / "heard.wav"), spatial="off", stream=False, delay_unit="unit")
        tasks = [
            asyncio.create_task(work)
            for work in (
                run_microphones([microphone], clock, start_ns),
                unit.run(),
                run_room(RoomConfig((device,)), oslo, clock),
                run_audio(mine, tokyo, clock),
                run_audio(theirs, oslo, clock),
            )
        ]
        pictures, said = oslo.publish(BY_NAME["image_delay"]), oslo.subscribe(BY_NAME["sound_status"], site="oslo")
        try:
            while clock.now_ns() - start_ns < SECONDS * 1e9:
                message = ImageDelay(site="oslo")
                message.header.t_ns = clock.now_ns()
                message.streams.add(participant="ann", delay_s=IMAGE_S)
                pictures.put(message)
                await clock.sleep_until_ns(clock.now_ns() + 500_000_000)
                for task in tasks:
                    if task.done():
                        task.result()
            for sample in said.take():
                status.CopyFrom(sample.message)
            asked.append(unit.tables.holding[0] * 1e-4)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        return unit

    unit = virtual_time.run(main())
    assert asked[0] > 0.08, "the unit does nothing"
    assert status.acoustic_known
    with wave.open(str(tmp_path / "heard.wav")) as file:
        mixed = np.frombuffer(file.readframes(file.getnframes()), "<i2")[::2].astype(np.float32) / 32768.0
    last = mixed[-5 * RATE :]
    unit.lines[0].actual_s = asked[0]
    unit.tables.holding[0] = round(asked[0] * 1e4)
    heard = np.concatenate([unit.process(0, last[k : k + 960]) for k in range(0, len(last) - 960, 960)])
    begin_s = (len(mixed) - len(last)) / RATE
    late: list[float] = []
    match = np.abs(np.correlate(heard, clap(), "valid"))
    for k in range(math.ceil((begin_s + 0.3) / EVERY_S), int((begin_s + 4.0) / EVERY_S)):
        expected = round((k * EVERY_S + PHASE_S + IMAGE_S - begin_s) * RATE)
        part = match[expected - RATE // 5 : expected + RATE // 5]
        late.append((int(np.argmax(part)) - RATE // 5) / RATE)
    assert len(late) >= 4
    assert np.median(late) == pytest.approx(0.0, abs=0.004), late
    assert np.max(np.abs(late)) < 0.015
