"""The page for guests with a camera, in a real browser: a film of a drawn person is its camera."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
from collections.abc import AsyncIterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from browser import Page, page
from guest_film import HIGH, LOW, RAISES, SITS, film, led, person, stills
from guest_room import GuestRoom, at_the_door

from vistel.capture.pointer import PointerCapture
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.posture.posture import Stance, pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.space.people import build_like
from vistel.v1.device_pb2 import CameraBodyFrame
from vistel_services.console import bundle, landmarks

SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")
CAMERA = ("--use-fake-device-for-media-stream",)
WRIST = JOINT_INDEX["left_hand"]


@contextlib.asynccontextmanager
async def in_the_room(folder: Path, patch: pytest.MonkeyPatch, *more: str) -> AsyncIterator[tuple[Page, GuestRoom]]:
    """A guest who has chosen a person. Skips where the pages have not been made."""
    if not (bundle.FOLDER / bundle.GUEST_BUNDLE).is_file():
        pytest.skip("the page for guests has not been made (make web)")
    async with page(folder, *SOFTWARE_GL, *CAMERA, *more, seldom=False) as tab, GuestRoom(folder).serving(patch) as room:
        await at_the_door(tab, room, room.invited(), 480, 320)
        await tab.click(".people button[aria-current=true]")
        await tab.until("window.guest.me() === 'guest-1'")
        yield tab, room


async def allow(tab: Page, room: GuestRoom, setting: str) -> None:
    origin = f"http://{room.address}"
    await tab.call("Browser.setPermission", permission={"name": "camera"}, setting=setting, origin=origin)


def test_a_camera_that_is_refused_missing_or_unplugged_is_told_in_a_line_and_mouse_and_keys_go_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(landmarks, "FOLDER", tmp_path / "nothing")

    async def visit() -> None:
        async with in_the_room(tmp_path, monkeypatch) as (tab, room):

            async def says(words: str) -> None:
                await tab.until(f"document.querySelector('#camera').innerText.includes({words!r})")

            await says("Use my camera")
            await allow(tab, room, "denied")
            await tab.click("#camera")
            await says("allow it beside the address")
            await allow(tab, room, "granted")
            await tab.click("#camera")
            await says("cannot be used here")  # what finds people in pictures is not on this machine
            await tab.value("navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException('', 'NotFoundError')), 1")
            await tab.click("#camera")
            await says("No camera is there")
            await tab.value("window.guest.camera.close('lost'), 1")
            await says("was unplugged")
            await tab.call("Input.dispatchKeyEvent", type="keyDown", key="w")
            await room.until(lambda: room.pointed and room.pointed[-1].gesture == 1, "a wave")
            assert not [m for m in room.seen if m.body]

    asyncio.run(visit())


@pytest.mark.measures
def test_a_guest_before_a_camera_moves_their_figure_and_no_other_host_is_asked(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A picture takes seconds without a graphics card, so the film goes slowly; what is waited for are places, not times."""
    if not (landmarks.FOLDER / "landmarks/holistic.js").is_file():
        pytest.skip("npm's @mediapipe/holistic is not there (make web)")
    sits, raises, low, high = stills(person("carla"), (SITS, RAISES, LOW, HIGH))
    shown = film(tmp_path / "film.mjpeg", [(sits, 8.0), (raises, 10.0), (low, 30.0), (high, 30.0)])
    log = tmp_path / "net.json"
    more = ("--use-fake-ui-for-media-stream", f"--use-file-for-fake-video-capture={shown}", f"--log-net-log={log}")

    async def visit() -> None:
        async with in_the_room(tmp_path, monkeypatch, *more) as (tab, room):

            async def wrist_at(holds: str) -> list[float]:
                return await tab.until(f"((p) => p && ({holds}) && p)(window.guest.joints('guest-1')[{WRIST}])")

            await tab.click("#camera")
            await tab.until("window.guest.camera.state === 'on'")
            await tab.until("document.getElementById('mirror').innerText.includes('Pictures never leave')")
            await wrist_at(f"p[1] > {high.joints.position[WRIST, 1] - 0.08}")
            lowered = await wrist_at(f"p[1] < {low.joints.position[WRIST, 1] + 0.06} && p[1] > 0.8")
            raised = await wrist_at(f"p[1] > {high.joints.position[WRIST, 1] - 0.06}")
            assert raised[1] - lowered[1] > 0.15
            room.take()
            assert any(m.calibrating for m in room.seen) and any(len(m.left_hand) for m in room.seen)
            sent = await tab.value("[window.guest.camera.sent, window.guest.camera.tookMs]")
            print(json.dumps({"inference_ms": round(sent[1]), "records": len(room.seen)}))
            await tab.value("window.guest.camera.video.srcObject.getTracks()[0].dispatchEvent(new Event('ended')), 1")
            await tab.until("document.querySelector('#camera').innerText.includes('was unplugged')")
            await wrist_at("p[1] < 0.75")  # in the lap
            assert not [m for m in tab.messages if "Refused" in m or "Content Security" in m], tab.messages
            await tab.call("Browser.close")

    asyncio.run(visit())
    asked = [e["params"]["url"] for e in json.loads(log.read_text())["events"] if "url" in e.get("params", {})]
    assert asked and np.all([u.startswith(("http://127.0.0.1:", "ws://127.0.0.1:", "data:", "blob:")) for u in asked]), asked


POSTURES = (
    LOW,
    HIGH,
    led((0.15, 1.10, 0.42), (-0.30, 1.10, 0.30)),
    led((0.30, 1.20, 0.30), None),
    led(None, (-0.10, 1.15, 0.45), yaw=0.3),
    led((0.05, 1.05, 0.40), (-0.05, 1.05, 0.40), yaw=-0.25),
    led((0.35, 1.05, 0.20), (-0.20, 1.25, 0.42), pitch=-0.3),
    led((0.28, 0.95, 0.30), (-0.15, 1.00, 0.40), yaw=0.15),
)
CALIBRATION = (SITS, RAISES, RAISES)
_LOOK = """(async () => {
  const data = Uint8Array.from(atob(%r), (c) => c.charCodeAt(0));
  const bitmap = await createImageBitmap(new Blob([data], { type: "image/png" }));
  window.looker.postMessage({ bitmap, at: Date.now() }, [bitmap]);
})()"""


async def looked_at(tab: Page, room: GuestRoom, pictures: list[np.ndarray]) -> list[CameraBodyFrame]:
    """What comes of each picture at the wire's end, where the page's camera gives it. Each is shown twice: one follows the last."""
    await tab.value(
        "(() => { const { camera } = window.guest; window.looker = new Worker('landmarks/camera_worker.js');"
        " for (const [n, v] of [['videoWidth', 640], ['videoHeight', 480]]) Object.defineProperty(camera.video, n, { value: v });"
        " window.looker.onmessage = ({ data }) => data.found ? camera.hear(data) : (window.looks = data); })()"
    )
    await tab.until("window.looks?.ready")
    out: list[CameraBodyFrame] = []
    for picture in pictures:
        done, data = cv2.imencode(".png", picture[:, :, ::-1])
        assert done
        for _ in range(2):
            count = len(room.seen)
            await tab.value(_LOOK % base64.b64encode(data.tobytes()).decode())
            await room.until(lambda n=count: len(room.seen) > n, "what is seen in a picture")
        out.append(room.seen[-1])
    return out


@pytest.mark.measures
@pytest.mark.parametrize("name", ["carla", "ben", "aiko", "hiro"])
def test_a_guest_is_near_the_drawn_person_before_the_camera(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    if not (landmarks.FOLDER / "landmarks/holistic.js").is_file():
        pytest.skip("npm's @mediapipe/holistic is not there (make web)")
    figure = person(name)
    drawn = stills(figure, (*CALIBRATION, *POSTURES))

    async def visit() -> list[CameraBodyFrame]:
        async with in_the_room(tmp_path, monkeypatch) as (tab, room):
            return await looked_at(tab, room, [still.picture for still in drawn])

    frames = asyncio.run(visit())
    skeleton = figure.avatar.skeleton
    guest = PointerCapture("bob", build_like(Proportions.of(skeleton, figure.avatar.body)), Stance(np.zeros(3), 0.0))
    off: dict[str, list[float]] = {"wrist_mm": [], "elbow_mm": [], "head_mm": [], "fingers_deg": []}
    t_ns = 10**18
    for n, (still, frame) in enumerate(zip(drawn, frames, strict=True)):
        posture = still.posture
        for _ in range(120):
            t_ns += 16_666_667
            frame.header.t_ns = frame.picture_t_ns = t_ns
            frame.calibrating = n < len(CALIBRATION)
            guest.see(frame)
            posture = guest.solve(t_ns)
        if n < len(CALIBRATION):
            continue
        apart = 1e3 * np.linalg.norm(pose_joints(skeleton, posture).position - still.joints.position, axis=1)
        off["head_mm"].append(apart[JOINT_INDEX["head"]])
        for row, (side, seen) in enumerate((("left", frame.left_hand), ("right", frame.right_hand))):
            if len(seen):
                off["wrist_mm"].append(apart[JOINT_INDEX[f"{side}_hand"]])
                off["elbow_mm"].append(apart[JOINT_INDEX[f"{side}_lower_arm"]])
                off["fingers_deg"] += [*np.degrees(np.abs(posture.hands[row] - still.posture.hands[row]))]
    print(json.dumps({"name": name} | {what: [round(float(np.quantile(v, q)), 1) for q in (0.5, 0.9)] for what, v in off.items()}))
    # What is wanted, and what is met, is in docs/how-to/invite-guests.md; this holds what is met.
    assert len(off["wrist_mm"]) >= 10
    assert np.median(off["wrist_mm"]) < 80 and np.median(off["elbow_mm"]) < 60
    assert np.median(off["head_mm"]) < 40 and np.median(off["fingers_deg"]) < 12
