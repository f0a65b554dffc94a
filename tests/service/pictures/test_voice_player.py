"""The jitter buffer of a page (clients/web/sound/player.ts), in node on simulated time: what it plays of what came when."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from vistel.arrays import F32, F64

ROOT = Path(__file__).resolve().parents[3]
ESBUILD = ROOT / "clients/web/node_modules/.bin/esbuild"
RATE, FRAME = 48_000, 960
BEGAN_MS = 1.7e12
PLAY = """
import { readFileSync, writeFileSync } from "node:fs";
import { CHUNK, Player } from "./player.mjs";
const { frames, pictures, chunks } = JSON.parse(readFileSync("given.json"));
const wave = new Float32Array(readFileSync("wave.f32").buffer.slice(0));
const player = new Player(), out = new Float32Array(chunks * CHUNK), skews = [];
for (let n = 0; n < chunks; n++) {
  const now = n * CHUNK / 48;
  for (; pictures.length && pictures[0][0] <= now; pictures.shift()) [player.clockMs, player.pictureMs] = pictures[0].slice(1);
  for (; frames.length && frames[0][0] <= now; frames.shift()) {
    const [came, capturedMs, delayMs, from] = frames[0];
    player.put({ capturedMs, delayMs, samples: wave.slice(from, from + 960) }, came);
  }
  const chunk = player.next(now);
  if (chunk) out.set(chunk, n * CHUNK);
  skews.push(player.skewMs(now + CHUNK / 48));
}
writeFileSync("out.f32", out);
console.log(JSON.stringify({ ...player.counts, skews }));
"""


@dataclass
class Played:
    """sound: what came out, from the clock's zero on; made, late, played: samples; skews: behind the picture after each chunk
    [ms]."""

    sound: F32
    played: int
    made: int
    late: int
    skews: list[float | None]

    def lag_ms(self, wave: F32, begin_s: float, end_s: float) -> tuple[float, float]:
        """How much later than it was captured a part of the wave is heard, and how alike the two are (correlation)."""
        first, part = round(begin_s * RATE), wave[round(begin_s * RATE) : round(end_s * RATE)].astype(np.float64)
        heard, count = self.sound[first : first + RATE // 2 + len(part)].astype(np.float64), len(part)
        part -= part.mean()
        sums, squares = (np.concatenate(([0.0], np.cumsum(x))) for x in (heard, heard**2))
        mean, square = ((x[count:] - x[:-count]) / count for x in (sums, squares))
        spread = np.sqrt(np.maximum(square - mean**2, 1e-12) * (part @ part) * count)
        seen, wanted = np.fft.rfft(heard), np.fft.rfft(part, len(heard))
        alike = np.fft.irfft(seen * wanted.conj(), len(heard))[: len(spread)] / spread
        return int(np.argmax(alike)) / RATE * 1e3, float(alike.max())


def speech(seconds: float, seed: int = 3) -> F32:
    """A voice that glides, with pauses of irregular length."""
    rng, out, at = np.random.default_rng(seed), np.zeros(round(seconds * RATE)), RATE // 10
    while at < len(out) - RATE:
        long = round(rng.uniform(0.3, 0.9) * RATE)
        pitch = np.cumsum(rng.uniform(100, 180) * (1 + 0.15 * np.sin(np.arange(long) / RATE * 9 + rng.uniform(0, 6)))) / RATE
        out[at : at + long] = 0.1 * sum(np.sin(2 * np.pi * k * pitch) / k for k in range(1, 12)) * np.hanning(long) ** 0.2
        at += long + round(rng.uniform(0.1, 0.4) * RATE)
    return out.astype(np.float32)


def play(folder: Path, wave: F32, came_ms: F64, pictures: list[tuple[float, float]], delay_ms: float = 150.0) -> Played:
    """came_ms: of each frame after its capture, NaN where it is lost; pictures: from a time on [ms], how late they are [ms]."""
    if not ESBUILD.exists() or shutil.which("node") is None:
        pytest.skip("the packages of the pages are not here (make web), or no node")
    source = ROOT / "clients/web/sound/player.ts"
    subprocess.run(
        [ESBUILD, source, "--bundle", "--format=esm", f"--outfile={folder / 'player.mjs'}", "--log-level=error"], check=True
    )
    (folder / "play.mjs").write_text(PLAY)
    frames = [
        (n * 20 + late, BEGAN_MS + n * 20, delay_ms, n * FRAME) for n, late in enumerate(came_ms.tolist()) if not np.isnan(late)
    ]
    told = [(at_ms, 0.0, late_ms - BEGAN_MS) for at_ms, late_ms in pictures]
    given = {"frames": sorted(frames), "pictures": told, "chunks": len(wave) // 384 + 60}
    (folder / "given.json").write_text(json.dumps(given))
    wave.astype("<f4").tofile(folder / "wave.f32")
    done = subprocess.run(["node", "play.mjs"], cwd=folder, check=True, capture_output=True, text=True)
    return Played(np.fromfile(folder / "out.f32", "<f4"), **json.loads(done.stdout))


def jittered(wave: F32, low_ms: float = 30.0, high_ms: float = 70.0) -> F64:
    return np.random.default_rng(1).uniform(low_ms, high_ms, len(wave) // FRAME)


def test_what_comes_in_time_is_heard_with_its_picture_sample_for_sample(tmp_path: Path) -> None:
    wave = speech(6.0)
    played = play(tmp_path, wave, jittered(wave), [(0.0, 10.0)])
    lag_ms, alike = played.lag_ms(wave, 1.0, 4.5)
    assert abs(lag_ms - 160.0) <= 5.0 and alike > 0.999
    assert played.made == played.late == 0
    assert max(abs(s) for s in played.skews if s is not None) <= 5.5


def test_what_comes_later_than_its_picture_is_heard_as_soon_as_nearly_all_of_it_is_there(tmp_path: Path) -> None:
    wave = speech(8.0)
    played = play(tmp_path, wave, jittered(wave), [(0.0, 10.0)], delay_ms=0.0)
    lag_ms, alike = played.lag_ms(wave, 3.0, 6.5)
    assert 65.0 <= lag_ms <= 85.0 and alike > 0.95
    assert played.made < 0.04 * played.played


def test_lost_frames_are_made_up_without_a_click(tmp_path: Path) -> None:
    wave = speech(10.0)
    came = jittered(wave)
    lost = np.random.default_rng(2).choice(len(came), len(came) // 20, replace=False)
    came[lost] = np.nan
    played = play(tmp_path, wave, came, [(0.0, 10.0)])
    lag_ms, alike = played.lag_ms(wave, 1.0, 8.5)
    assert abs(lag_ms - 160.0) <= 8.0 and alike > 0.9
    assert 0.01 < played.made / played.played < 0.09
    assert np.abs(np.diff(played.sound)).max() < 1.2 * np.abs(np.diff(wave)).max()


def test_a_halt_is_heard_once_and_made_up_soon(tmp_path: Path) -> None:
    wave = speech(9.0)
    came = jittered(wave)
    held = (np.arange(len(came)) * 20 + came > 3000) & (np.arange(len(came)) * 20 + came < 3600)
    came[held] = 3600 - np.arange(len(came))[held] * 20
    played = play(tmp_path, wave, came, [(0.0, 10.0)])
    assert abs(played.lag_ms(wave, 1.0, 2.8)[0] - 160.0) <= 5.0
    lag_ms, alike = played.lag_ms(wave, 5.0, 7.5)
    assert abs(lag_ms - 160.0) <= 8.0 and alike > 0.99


@pytest.mark.parametrize("after_ms", [90.0, -60.0])
def test_a_picture_that_gets_later_or_earlier_is_followed_without_loss(tmp_path: Path, after_ms: float) -> None:
    wave = speech(10.0)
    played = play(tmp_path, wave, jittered(wave), [(0.0, 10.0), (3000.0, 10.0 + after_ms)])
    lag_ms, alike = played.lag_ms(wave, 5.0, 8.5)
    assert abs(lag_ms - 160.0 - after_ms) <= 5.5 and alike > 0.99
    assert played.made == played.late == 0
    assert np.abs(np.diff(played.sound)).max() < 1.2 * np.abs(np.diff(wave)).max()
