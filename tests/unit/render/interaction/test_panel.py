"""The panel beside the picture, and what is done without one."""

from __future__ import annotations

import builtins
import logging
from typing import Any

import numpy as np
import pytest

from vistel.render.gl.context import GlContext
from vistel.render.interaction.events import LEFT, Button, Key, Pointer
from vistel.render.interaction.panel import PanelState, open_panel
from vistel.render.interaction.requests import CommandRequest
from vistel.render.interaction.status import ConferenceStatus, SiteStatus
from vistel.render.interaction.window_interaction import WindowInteraction
from vistel.render.stage.stage import Instant
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import look_at
from vistel.render.view.view import Choices, Mode
from vistel.space.actions import RaiseHand, React
from vistel.space.arguments import Reaction
from vistel.v1.world_pb2 import Signals

pytestmark = pytest.mark.gl


def test_without_a_panel_to_be_had_one_line_says_so_and_keys_do_it(
    surface: GlContext, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    real = builtins.__import__

    def without(name: str, *args: Any, **kw: Any) -> Any:
        if name.startswith("imgui_bundle"):
            raise ImportError("No module named 'imgui_bundle'")
        return real(name, *args, **kw)

    monkeypatch.setattr(builtins, "__import__", without)
    with caplog.at_level(logging.WARNING):
        assert open_panel(surface.ctx) is None
    (line,) = [r.message for r in caplog.records if "no_panel" in r.message]
    assert "vistel[window]" in line and "using=keys" in line


SHOWN = PanelState(
    ConferenceStatus(
        (SiteStatus("tokyo", ("aiko",), 1, 29.7, 0.131, 4), SiteStatus("lima", faults=("glove: 100% gone",), devices=2, heard_ns=1))
    ),
    title="VISTEL 東京",
    now_ns=2,
    hertz=30.0,
)


def test_the_panel_is_drawn_over_the_picture_and_its_buttons_choose(surface: GlContext) -> None:
    pytest.importorskip("imgui_bundle", reason="the panel needs imgui-bundle")
    ctx = surface.ctx
    target = ctx.simple_framebuffer((800, 600))
    panel = open_panel(ctx)
    assert panel is not None
    try:
        choices = Choices(Mode.SEAT, "aiko")

        def frame() -> np.ndarray:
            nonlocal choices
            target.use()
            target.clear(0.2, 0.4, 0.6)
            choices = panel.draw(SHOWN, choices, (800, 600), 0.03)
            return np.frombuffer(target.read(), np.uint8).reshape(600, 800, 3)[::-1].astype(int)

        for _ in range(3):
            picture = frame()
        assert (picture[:, :400] == picture[5, 5]).all()
        assert np.abs(picture[40:400, 480:780] - picture[5, 5]).max(axis=2).mean() > 60

        def pressed(x: float, y: float) -> None:
            panel.take(Pointer(x, y))
            frame()
            for down in (True, False):
                panel.take(Button(LEFT, down, x, y))
                frame()

        found = False
        for y in range(30, 520, 9):  # wherever the panel has put its buttons
            pressed(560, y)
            pressed(640, y)
            found = found or choices.mode is not Mode.SEAT
            if found:
                break
        assert choices.mode in (Mode.FREE, Mode.ROOM)
        panel.open = False
        assert (frame() == picture[5, 5]).all()
        assert ctx.error == "GL_NO_ERROR"
    finally:
        panel.close()
        target.release()


class Keys:
    """A window at which somebody presses keys, and nothing else."""

    eyes_apart = False

    def __init__(self) -> None:
        self.pressed: list[Any] = []

    def events(self) -> list[Any]:
        out, self.pressed = self.pressed, []
        return out

    def size(self, number: int = 0) -> tuple[int, int]:
        return 640, 480


def desk(surface: GlContext, keys: Any) -> WindowInteraction:
    return WindowInteraction(surface.ctx, keys, "aiko", Choices(Mode.SEAT, "aiko"), "VISTEL", {}, panel=lambda ctx: None)


def test_a_desk_without_a_panel_looks_about_by_keys(surface: GlContext) -> None:
    keys = Keys()
    interaction = desk(surface, keys)
    base = look_at(np.array((0.0, 1.2, -0.7)), np.array((0.0, 0.9, 0.0)), 0.9)
    assert interaction.camera(base) is base
    keys.pressed = [Key("f1", True), Key("w", True)]
    interaction.take(Instant(1_000_000_000), [], (640, 480))
    interaction.take(Instant(1_050_000_000), [], (640, 480))
    assert (interaction.camera(base).position - base.position)[2] > 0.05
    assert any("walk" in text for text, _ in interaction.rows())
    keys.pressed = [Key("w", False), Key("1", True)]
    interaction.take(Instant(1_100_000_000), [], (640, 480))
    assert interaction.camera(base) is base


def test_r_raises_ones_own_hand_and_takes_it_down_and_shift_with_a_digit_reacts(surface: GlContext) -> None:
    keys = Keys()
    interaction = desk(surface, keys)

    def asked(pressed: list[Key], *raised: str) -> list[Any]:
        keys.pressed = pressed
        signals = Signals(raised=[Signals.RaisedHand(participant=name) for name in raised])
        interaction.take(Instant(1_000_000_000, world=PlayoutWorld(1, {}, signals=signals)), [], (640, 480))
        return [request.action for request in interaction.requests() if isinstance(request, CommandRequest)]

    assert asked([Key("r", True), Key("r", False)]) == [RaiseHand()]
    assert asked([Key("r", True), Key("r", False)], "bruno") == [RaiseHand()]
    assert asked([Key("r", True), Key("r", False)], "bruno", "aiko") == [RaiseHand(down=True)]
    for n, reaction in enumerate(Reaction, 1):
        assert asked([Key("shift", True), Key(str(n), True), Key(str(n), False), Key("shift", False)]) == [React(reaction)]
    assert asked([Key("3", True), Key("3", False)]) == [], "without shift it is a view"
    assert interaction.choices.mode is Mode.ROOM
