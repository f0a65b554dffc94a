"""What a guest's page makes of landmarks (clients/web/join/landmarks.ts), in node: the record that the driver reads, and what is
told of a picture."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vistel.protocol.pages.camera_body import BODY, FACE, HAND_POINTS, camera_body_of

WEB = Path(__file__).resolve().parents[3] / "clients/web"
ASPECT = 4 / 3
NOW_NS = 10**18
_RUN = """
import { readFileSync } from "node:fs";
import { Judge, record } from "./landmarks.mjs";
const { found, pictures } = JSON.parse(readFileSync(0, "utf-8"));
const judge = new Judge();
const data = record(found, 4 / 3, true);
new DataView(data).setFloat64(4, 1e12, true);
const notes = pictures.map((p) => judge.note(p.found, 4 / 3, p.light, p.at));
console.log(JSON.stringify({ record: Buffer.from(data).toString("base64"), notes }));
"""


@pytest.fixture
def run(tmp_path: Path) -> Any:
    node, esbuild = shutil.which("node"), WEB / "node_modules/.bin/esbuild"
    if node is None or not esbuild.is_file():
        pytest.skip("node or clients/web/node_modules is not there (make web)")
    out = tmp_path / "landmarks.mjs"
    subprocess.run([esbuild, "join/landmarks.ts", "--format=esm", f"--outfile={out}"], cwd=WEB, check=True, capture_output=True)
    (tmp_path / "run.mjs").write_text(_RUN)

    def ran(found: dict[str, Any], pictures: list[dict[str, Any]]) -> Any:
        given = json.dumps({"found": found, "pictures": pictures})
        done = subprocess.run([node, "run.mjs"], cwd=tmp_path, input=given, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return ran


def points(count: int, seed: int) -> list[dict[str, float]]:
    drawn = np.random.default_rng(seed).uniform(0.2, 0.8, (count, 4))
    return [{"x": x, "y": y, "z": z - 0.5, "visibility": v} for x, y, z, v in drawn.tolist()]


def body(left: tuple[float, float] = (0.65, 0.6), right: tuple[float, float] = (0.35, 0.6)) -> list[dict[str, float]]:
    found = points(33, 1)
    for n, (x, y) in ((11, left), (12, right)):
        found[n] |= {"x": x, "y": y}
    return found


def test_the_driver_reads_what_the_page_writes(run: Any) -> None:
    found = {"body": points(33, 1), "world": points(33, 2), "left": points(21, 3), "right": points(21, 4), "face": points(478, 5)}
    frame = camera_body_of(base64.b64decode(run(found, [])["record"]), NOW_NS)
    assert frame is not None and frame.calibrating and frame.picture_t_ns == NOW_NS
    assert (len(frame.body), len(frame.left_hand), len(frame.face)) == (3 * len(BODY), 3 * HAND_POINTS, 3 * len(FACE))
    nose, world = found["body"][0], found["world"][0]
    assert frame.body[0] == pytest.approx((nose["x"] - 0.5) * ASPECT * 1e4, abs=1)
    assert frame.body[1] == pytest.approx((0.5 - nose["y"]) * 1e4, abs=1) and frame.body[2] == pytest.approx(
        -1e3 * world["z"], abs=6
    )
    for seen, told in ((found["left"], frame.left_hand), (found["right"], frame.right_hand)):
        wanted = [((p["x"] - 0.5) * ASPECT, 0.5 - p["y"], -p["z"] * ASPECT) for p in seen]
        assert np.abs(np.reshape(told, (-1, 3)) - 1e4 * np.array(wanted)).max() < 40  # of a hand as large as the picture
    iris, chin = found["face"][473], found["face"][152]
    for at, p in (("left_iris", iris), ("chin", chin)):
        assert frame.face[3 * FACE.index(at)] == pytest.approx((p["x"] - 0.5) * ASPECT * 1e4, abs=40)


def test_a_picture_without_anybody_is_a_record_without_parts(run: Any) -> None:
    frame = camera_body_of(base64.b64decode(run({}, [])["record"]), NOW_NS)
    assert frame is not None and not frame.body and not frame.face


def test_a_page_tells_black_pictures_nobody_half_a_person_light_from_behind_and_somebody_else(run: Any) -> None:
    face = points(478, 3)

    def noted(*pictures: tuple[dict[str, Any], float, float]) -> list[str]:
        return run({}, [{"found": f, "light": light, "at": at} for f, light, at in pictures])["notes"]

    there = {"body": body(), "face": face}
    aside = {"body": body((0.95, 0.6), (0.75, 0.6)), "face": face}
    near = {"body": body((0.85, 0.6), (0.15, 0.6)), "face": face}
    assert noted((there, 3, 0), ({}, 120, 40), (there, 120, 80)) == ["dark", "nobody", ""]
    assert noted(({"body": body((1.05, 0.6), (0.75, 0.6)), "face": face}, 120, 0)) == ["half"]
    assert noted(({"body": body()}, 200, 0), ({"body": body()}, 90, 40)) == ["light", "half"]
    assert noted((there, 120, 0), (aside, 120, 40), (aside, 120, 80)) == ["", "other", ""]
    assert noted((there, 120, 0), (near, 120, 40)) == ["", "other"]
    assert noted((there, 120, 0), (aside, 120, 5000)) == ["", ""]  # people move, given time
