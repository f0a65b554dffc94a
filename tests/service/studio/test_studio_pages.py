"""The studios' pages in a real browser: an avatar is turned, posed and smiles; a face is calibrated; one navigation leads round."""

from __future__ import annotations

import asyncio
import contextlib
import shutil
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from aiohttp import web
from avatar_fixture import long_armed
from browser import Page, page

from vistel.conference.files import load
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.avatar.patch import Patch
from vistel.figure.posture.posture import pose_joints
from vistel.figure.posture.standard import standard_postures
from vistel.figure.skeleton import JOINT_INDEX
from vistel.vision.gaze_calibration import read_gaze
from vistel_cli.studio import avatar as avatar_page
from vistel_cli.studio import calibration as calibration_page
from vistel_cli.studio.avatar import AvatarStudio
from vistel_cli.studio.calibration import CalibrationStudio
from vistel_cli.studio.pages import PAGE, studios

FILE = """
name = "lab"
[[sites]]
name = "here"
[[sites.participants]]
name = "ada"
[sites.participants.eye]
"""
SETTLED = "!!window.vistelAvatar && window.vistelAvatar.settled()"
AVATAR = long_armed()


@contextlib.asynccontextmanager
async def tab_of(folder: Path, at: str, avatar: Avatar = AVATAR, complains: str = "GL Driver Message") -> AsyncIterator[Page]:
    """complains: in what the browser may say beside what it says of slow graphics."""
    if not (PAGE / "avatar.js").is_file():
        pytest.skip("the pages' scripts have not been made: npm's registry was not reached")
    file = folder / "lab.toml"
    file.write_text(FILE)
    hosts: set[str] = set()
    parts = {"avatar": AvatarStudio(lambda: avatar, "me").app(), "calibration": CalibrationStudio(load(file), file).app()}
    runner = web.AppRunner(studios(parts, hosts, "avatar"), shutdown_timeout=1.0)
    await runner.setup()
    try:
        await web.TCPSite(runner, "127.0.0.1", 0).start()
        address = f"127.0.0.1:{runner.addresses[0][1]}"
        hosts.add(address)
        async with page(folder, "--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader") as tab:
            await tab.open(f"http://{address}/{at}", 1000, 700)
            yield tab
            assert [m for m in tab.messages if complains not in m and "GL Driver Message" not in m] == []
    finally:
        await runner.cleanup()


def test_an_avatar_sits_down_on_the_page_as_in_the_library_and_a_slider_bends_its_elbow(tmp_path: Path) -> None:
    async def look() -> None:
        async with tab_of(tmp_path, "") as tab:
            await tab.until(SETTLED)
            await tab.value("[...document.querySelectorAll('aside button')].find((b) => b.textContent === 'table').click()")
            wanted = pose_joints(AVATAR.skeleton, standard_postures()["table"]).position
            await tab.until(f"{SETTLED} && Math.abs(window.vistelAvatar.joints()[0][1] - {wanted[0, 1]}) < 1e-3")
            hand = JOINT_INDEX["left_hand"]
            assert await tab.value(f"window.vistelAvatar.joints()[{hand}]") == pytest.approx(wanted[hand], abs=1e-3)
            bend = "document.querySelector('label.slider input')"  # the first: the left elbow
            await tab.value(f"{bend}.value = 120; {bend}.dispatchEvent(new Event('input', {{ bubbles: true }}))")
            away = f"((j) => Math.hypot(...j[{hand}].map((x, k) => x - j[{JOINT_INDEX['left_upper_arm']}][k])))"
            straight = AVATAR.skeleton.length("left_upper_arm", "left_lower_arm") + AVATAR.skeleton.length(
                "left_lower_arm", "left_hand"
            )
            await tab.until(f"{SETTLED} && {away}(window.vistelAvatar.joints()) < {0.6 * straight}")
            await tab.until("document.querySelector('aside section').textContent.includes('mesh')")  # it is judged
            drawn = await tab.value("window.vistelAvatar.drawn()")
            await tab.value("document.getElementById('figure').dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft' }))")
            await tab.until(f"window.vistelAvatar.drawn() > {drawn}")

    asyncio.run(look())


def test_from_the_avatar_one_comes_to_calibration_where_an_eye_is_measured_and_kept(tmp_path: Path) -> None:
    async def look() -> None:
        async with tab_of(tmp_path, "avatar/") as tab:
            await tab.until("document.querySelectorAll('#studios a').length === 2")
            await tab.click("#studios a:nth-child(2)")
            await tab.until("location.pathname === '/calibration/' && !!document.querySelector('[data-what=\"ada gaze\"]')")
            await tab.click('[data-what="ada gaze"]')
            await tab.until("!!document.querySelector('.live img, #keep')")
            await tab.until("!!document.querySelector('#keep')")
            assert await tab.value("document.querySelector('.say').textContent") == "Found: good"
            await tab.click("#keep")
            await tab.until("document.querySelector('#stage code')?.textContent === 'eye.calibration = \"ada-eye.json\"'")
            read_gaze(tmp_path / "ada-eye.json")

    asyncio.run(look())


def test_what_is_of_strands_mirrors_light_across_them(tmp_path: Path) -> None:
    async def brightness(strands: bool) -> float:
        whole = Patch((0.0, 0.0, 1.0, 1.0), 0.7, 0.0, opacity=np.full((4, 4), 255, np.uint8), strands=strands)
        folder = tmp_path / f"{strands}"
        folder.mkdir()
        async with tab_of(folder, "", replace(AVATAR, patches=(whole,))) as tab:
            await tab.until(SETTLED)
            drawn = await tab.value("window.vistelAvatar.drawn()")
            await tab.value("document.querySelectorAll('#views button')[1].click()")
            await tab.until(f"window.vistelAvatar.drawn() > {drawn}")
            return float((await tab.picture())[100:600, 50:600].mean())

    plain, shining = (asyncio.run(brightness(strands)) for strands in (False, True))
    assert shining > plain + 1.0


@pytest.mark.parametrize("studio", ["avatar", "calibration"])
def test_a_page_whose_script_has_not_been_made_says_how_to_make_it(
    studio: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bare = tmp_path / "page"
    bare.mkdir()
    for file in (file for file in PAGE.iterdir() if file.suffix != ".js"):
        shutil.copy(file, bare)
    for module in (avatar_page, calibration_page):
        monkeypatch.setattr(module, "PAGE", bare)

    async def look() -> None:
        async with tab_of(tmp_path, f"{studio}/", complains="404") as tab:
            await tab.until("document.getElementById('trouble').textContent.includes('make web')")

    asyncio.run(look())
