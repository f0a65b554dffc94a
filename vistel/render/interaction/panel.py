"""The panel beside the picture: sites, delays, how it is drawn, from where, and whether it is recorded.

Built with Dear ImGui (imgui-bundle), which need not be there: then the window goes by keys alone.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import moderngl
from PIL import ImageFont

from vistel.fonts import JAPANESE
from vistel.render.interaction.events import Button, Event, Key, Pointer, Text, Wheel
from vistel.render.interaction.imgui_painter import ImguiPainter
from vistel.render.interaction.status import ConferenceStatus
from vistel.render.stage.stage import PersonNow
from vistel.render.view.view import Choices, Mode

log = logging.getLogger("vistel.renderer")

WIDTH = 336.0
"""Of the panel, in units of a font of 15."""
SCALES = (("as there is time", 0.0), ("all", 1.0), ("71 %", 0.71), ("half", 0.5))
"""Words and parts of the width and height that are drawn; 0: as there is time for."""
Colour = tuple[float, float, float, float]
_LATE_S = 0.5
"""A picture later than this is shown as bad [s]."""
_SKEWED_S = 0.08
"""A voice this much off its picture is shown as bad [s]."""
_GOOD = (0.55, 0.90, 0.62, 1.0)
_BAD = (1.0, 0.66, 0.43, 1.0)
_DIM = (0.64, 0.68, 0.73, 1.0)
_RED = (0.86, 0.22, 0.20, 1.0)


@dataclass(frozen=True)
class PanelState:
    """What the panel shows. drawn: part of the width and height that is; stereo: both eyes' pictures are shown; walled: on
    screens of a wall; pointed, selected: things, in words."""

    status: ConferenceStatus = field(default_factory=ConferenceStatus)
    people: Sequence[PersonNow] = ()
    now_ns: int = 0
    hertz: float = 0.0
    drawn: float = 1.0
    title: str = ""
    stereo: bool = False
    walled: bool = False
    pointed: str = ""
    selected: str = ""


KEYS = (
    ("W A S D, Q E", "walk, down and up; with shift, run"),
    ("arrows, right button", "look about; wheel: nearer"),
    ("1  2  3", "own seat, free, overview"),
    ("F", "through the next person's eyes"),
    ("click", "select; on nothing: no more"),
    ("drag", "move a thing; wheel: to and fro; R: turn"),
    ("drag on a board", "write; with X, rub out"),
    ("G  L", "own hand takes hold, lets go"),
    ("U  Y", "take back, do again"),
    ("R", "raise a hand, take it down"),
    ("shift and 1 to 5", "react: thumb, clap, heart, laugh, surprise"),
    ("F1", "this panel"),
    ("F9", "record, or no longer"),
)
"""What keys and buttons do, in the order in which the help lists it."""

_IMGUI_KEYS = {
    "tab": "tab",
    "left": "left_arrow",
    "right": "right_arrow",
    "up": "up_arrow",
    "down": "down_arrow",
    "home": "home",
    "end": "end",
    "delete": "delete",
    "backspace": "backspace",
    "space": "space",
    "enter": "enter",
    "escape": "escape",
    "a": "a",
    "c": "c",
    "v": "v",
    "x": "x",
    "y": "y",
    "z": "z",
}


def open_panel(ctx: moderngl.Context) -> Panel | None:
    """The panel, or None, and a line that says what is missing."""
    try:
        from imgui_bundle import imgui  # noqa: PLC0415  (optional, and needs a display's libraries)
    except ImportError as e:
        log.warning("event=no_panel reason=%r using=keys mend=\"pip install 'vistel[window]'\"", str(e))
        return None
    return Panel(ctx, imgui)


class Panel:
    """One at a time: ImGui has one context."""

    def __init__(self, ctx: moderngl.Context, imgui: Any) -> None:
        self._imgui = imgui
        self._context = imgui.create_context()
        imgui.set_current_context(self._context)
        io = imgui.get_io()
        io.set_ini_filename("")
        io.set_log_filename("")
        _fonts(imgui)
        _looks(imgui)
        self._painter = ImguiPainter(ctx, imgui)
        self.open = True
        self.pressed: list[str] = []
        """Names of the buttons that were pressed: "take", "let go", "undo", "redo", "record"."""

    def take(self, event: Event) -> bool:
        """Something was done; whether it was meant for the panel."""
        imgui = self._imgui
        io = imgui.get_io()
        if isinstance(event, Pointer):
            io.add_mouse_pos_event(event.x, event.y)
            return False  # whoever draws a mouse over the picture may pass under the panel
        if isinstance(event, Button):
            io.add_mouse_pos_event(event.x, event.y)
            if event.number < 3:
                io.add_mouse_button_event(event.number, event.down)
            return bool(io.want_capture_mouse) and event.down
        if isinstance(event, Wheel):
            io.add_mouse_wheel_event(event.sideways, event.notches)
            return bool(io.want_capture_mouse)
        if isinstance(event, Text):
            io.add_input_characters_utf8(event.text)
            return bool(io.want_text_input)
        if isinstance(event, Key):
            if event.name in _IMGUI_KEYS:
                io.add_key_event(getattr(imgui.Key, _IMGUI_KEYS[event.name]), event.down)
            return bool(io.want_text_input) and event.down
        io.add_focus_event(False)  # what is left is FocusLost
        return False

    def draw(self, shown: PanelState, choices: Choices, size: tuple[int, int], seconds: float, scale: float = 1.0) -> Choices:
        """Build and draw the panel into the framebuffer that is bound, of `size` pixels; what is chosen after it. seconds: since
        the last time; scale: of its writing."""
        imgui = self._imgui
        io = imgui.get_io()
        io.display_size = imgui.ImVec2(*size)
        io.delta_time = max(1e-4, seconds)
        imgui.get_style().font_scale_main = scale
        imgui.new_frame()
        self.pressed = []
        if self.open:
            choices = self._build(shown, choices, size, scale)
        imgui.render()
        self._painter.draw(imgui.get_draw_data(), size[1])
        return choices

    def close(self) -> None:
        """Give everything back."""
        self._painter.release()
        self._imgui.destroy_context(self._context)

    def _build(self, shown: PanelState, choices: Choices, size: tuple[int, int], scale: float) -> Choices:
        imgui = self._imgui
        margin = 8.0
        width = min(WIDTH * scale, size[0] - 2 * margin)
        imgui.set_next_window_pos(imgui.ImVec2(size[0] - width - margin, margin), imgui.Cond_.first_use_ever)
        imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, size[1] - 2 * margin))
        flags = imgui.WindowFlags_.always_auto_resize
        seen, self.open = imgui.begin(f"{shown.title}###panel", True, flags)
        if seen:
            choices = self._sections(shown, choices)
        imgui.end()
        return choices

    def _sections(self, shown: PanelState, choices: Choices) -> Choices:
        imgui = self._imgui
        opened = imgui.TreeNodeFlags_.default_open
        self._record(shown)
        if shown.status.notice:
            imgui.push_text_wrap_pos(0.0)
            self._say(shown.status.notice, (_BAD if shown.status.warning else _GOOD))
            imgui.pop_text_wrap_pos()
        if imgui.collapsing_header("Sites", opened):
            self._sites(shown)
        if imgui.collapsing_header("People and their delays", opened):
            self._delays(shown)
        if not shown.walled and imgui.collapsing_header("View", opened):
            choices = self._view(shown, choices)
        if imgui.collapsing_header("Things", opened):
            self._things(shown)
        if imgui.collapsing_header("Picture"):
            choices = self._picture(shown, choices)
        if imgui.collapsing_header("Keys and mouse"):
            self._table("keys", ("key", "does"), [[(k, None), (v, _DIM)] for k, v in KEYS], heads=False)
        return choices

    def _record(self, shown: PanelState) -> None:
        imgui = self._imgui
        film = shown.status.film
        if film:
            imgui.push_style_color(imgui.Col_.button, imgui.ImVec4(*_RED))
        if imgui.button("Stop recording" if film else "Record"):
            self.pressed.append("record")
        if film:
            imgui.pop_style_color()
        imgui.same_line()
        self._say(film or f"{shown.hertz:.0f} pictures/s at {round(100 * shown.drawn)} %", _DIM)

    def _sites(self, shown: PanelState) -> None:
        rows: list[list[tuple[str, Colour | None]]] = []
        notes: list[str] = []
        for site in shown.status.sites:
            state = site.state(shown.now_ns)
            rows.append(
                [
                    (site.name, None),
                    (", ".join(site.people), _DIM),
                    (f"{site.rate:.0f}" if site.rate else "-", None),
                    (f"{site.delay * 1e3:.0f}" if site.delay else "-", None),
                    (state, _GOOD if state == "well" else _BAD),
                ]
            )
            notes += [f"{site.name}: {fault}" for fault in site.faults]
        self._table("sites", ("site", "people", "1/s", "ms", "is"), rows)
        for note in notes[:4]:
            self._imgui.push_text_wrap_pos(0.0)
            self._say(note, _BAD)
            self._imgui.pop_text_wrap_pos()

    def _delays(self, shown: PanelState) -> None:
        rows: list[list[tuple[str, Colour | None]]] = []
        for person in shown.people:
            t, name = person.timing, person.about.name
            late = t.holding or t.age_ns * 1e-9 > _LATE_S
            skew = shown.status.skew.get(name)
            off = skew is not None and abs(skew) > _SKEWED_S
            rows.append(
                [
                    (person.about.display_name, None),
                    (f"{t.delay_ns * 1e-6:.0f}", None),
                    (f"{t.age_ns * 1e-6:.0f}", _BAD if late else None),
                    (f"{t.jitter_ns * 1e-6:.0f}", None),
                    ("-" if skew is None else f"{skew * 1e3:+.0f}", _BAD if off else None),
                ]
            )
        self._table("people", ("who", "delay", "age", "jitter", "voice"), rows)
        delays = [p.timing.delay_ns for p in shown.people]
        apart = f"; {(max(delays) - min(delays)) * 1e-6:.0f} ms between people" if len(delays) > 1 else ""
        self._say(f"milliseconds{apart}", _DIM)

    def _view(self, shown: PanelState, choices: Choices) -> Choices:
        imgui = self._imgui
        for n, (mode, name) in enumerate(((Mode.SEAT, "Seat"), (Mode.FREE, "Free"), (Mode.ROOM, "Room"))):
            if n:
                imgui.same_line()
            if imgui.radio_button(name, choices.mode is mode):
                choices = replace(choices, mode=mode)
        names = {p.about.name: p.about.display_name for p in shown.people}
        imgui.set_next_item_width(-1.0)
        followed = names.get(choices.who, choices.who) if choices.mode is Mode.FOLLOW else ""
        if imgui.begin_combo("##follow", f"Through the eyes of {followed}" if followed else "Through somebody's eyes"):
            for name, display in names.items():
                if imgui.selectable(f"{display}##{name}", choices.mode is Mode.FOLLOW and name == choices.who)[0]:
                    choices = replace(choices, mode=Mode.FOLLOW, who=name)
            imgui.end_combo()
        return choices

    def _things(self, shown: PanelState) -> None:
        imgui = self._imgui
        imgui.text_unformatted(f"Selected: {shown.selected or 'nothing'}")
        self._say(f"Under the mouse: {shown.pointed or 'nothing'}", _DIM)
        for n, (words, action) in enumerate((("Take", "take"), ("Let go", "let go"), ("Undo", "undo"), ("Redo", "redo"))):
            if n:
                imgui.same_line()
            if imgui.button(words):
                self.pressed.append(action)

    def _picture(self, shown: PanelState, choices: Choices) -> Choices:
        imgui = self._imgui
        imgui.text_unformatted("Pixels drawn:")
        for words, scale in SCALES:
            imgui.same_line()
            if imgui.radio_button(words if scale else "auto", choices.scale == scale):
                choices = replace(choices, scale=scale)
        imgui.text_unformatted("Light:")
        for light in ("fast", "fine"):
            imgui.same_line()
            if imgui.radio_button(light, choices.light == light):
                choices = replace(choices, light=light)
        changed, gauges = imgui.checkbox("Delays over the picture", choices.gauges)
        choices = replace(choices, gauges=gauges) if changed else choices
        if shown.stereo:
            imgui.set_next_item_width(150)
            changed, mm = imgui.slider_float("between the eyes", 1e3 * choices.eye_distance, 0.0, 80.0, "%.0f mm")
            choices = replace(choices, eye_distance=1e-3 * mm) if changed else choices
            if not shown.walled:
                imgui.set_next_item_width(150)
                changed, m = imgui.slider_float("to the display", choices.convergence, 0.3, 5.0, "%.2f m")
                choices = replace(choices, convergence=m) if changed else choices
        return choices

    def _say(self, text: str, colour: Colour | None = None) -> None:
        """A line; it may hold anything, for it is no format."""
        if colour is None:
            self._imgui.text_unformatted(text)
            return
        self._imgui.push_style_color(self._imgui.Col_.text, self._imgui.ImVec4(*colour))
        self._imgui.text_unformatted(text)
        self._imgui.pop_style_color()

    def _table(
        self, name: str, heads_: Sequence[str], rows: Sequence[Sequence[tuple[str, Colour | None]]], heads: bool = True
    ) -> None:
        imgui = self._imgui
        if not rows:
            self._say("nobody yet", _DIM)
            return
        flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_fixed_fit
        if not imgui.begin_table(name, len(heads_), flags):
            return
        for n, head in enumerate(heads_):
            stretch = n == (1 if name in ("sites", "keys") else 0)
            imgui.table_setup_column(head, imgui.TableColumnFlags_.width_stretch if stretch else 0)
        if heads:
            imgui.table_headers_row()
        for row in rows:
            imgui.table_next_row()
            for text, colour in row:
                imgui.table_next_column()
                self._say(text, colour)
        imgui.end_table()


def _fonts(imgui: Any) -> None:
    """DejaVu Sans, and a Japanese font behind it, where the system has them."""
    atlas = imgui.get_io().fonts
    found = [path for names in (("DejaVuSans.ttf",), JAPANESE) if (path := _path(names))]
    for n, path in enumerate(found):
        config = imgui.ImFontConfig()
        config.merge_mode = n > 0
        atlas.add_font_from_file_ttf(path, 15.0, config)
    if not found:
        atlas.add_font_default()


def _path(names: Sequence[str]) -> str:
    for name in names:
        try:
            return str(ImageFont.truetype(name, 12).path)
        except OSError:
            continue
    return ""


def _looks(imgui: Any) -> None:
    imgui.style_colors_dark()
    style = imgui.get_style()
    style.window_rounding, style.frame_rounding = 6.0, 4.0
    colours: Mapping[Any, tuple[float, float, float, float]] = MappingProxyType(
        {
            imgui.Col_.window_bg: (0.06, 0.07, 0.09, 0.90),
            imgui.Col_.title_bg_active: (0.10, 0.20, 0.28, 1.0),
            imgui.Col_.title_bg: (0.08, 0.12, 0.16, 1.0),
            imgui.Col_.header: (0.16, 0.24, 0.31, 1.0),
            imgui.Col_.header_hovered: (0.20, 0.32, 0.42, 1.0),
            imgui.Col_.button: (0.18, 0.30, 0.40, 1.0),
            imgui.Col_.check_mark: (0.55, 0.90, 0.62, 1.0),
            imgui.Col_.frame_bg: (0.15, 0.19, 0.24, 1.0),
            imgui.Col_.table_row_bg_alt: (1.0, 1.0, 1.0, 0.03),
            imgui.Col_.table_header_bg: (0.10, 0.13, 0.16, 1.0),
        }
    )
    for which, colour in colours.items():
        style.set_color_(which, imgui.ImVec4(*colour))
