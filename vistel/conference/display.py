"""What a site sees: the section `[sites.display]` of a conference file."""

import math
from typing import Literal

from pydantic import Field, field_validator, model_validator

from vistel.conference.devices import Checked, Name
from vistel.conference.page_address import TOKEN, StreamTls, checked_page, page_at, page_is_local, page_url

Place = tuple[float, float, float]


class Screen(Checked):
    """A flat screen of a wall. Corners in metres in the frame of the viewer's seat: its origin on the floor under the seat,
    +Y up, +Z where the viewer faces, +X to their left."""

    name: Name
    lower_left: Place
    lower_right: Place
    upper_left: Place
    """As the viewer sees it."""
    width: int = Field(default=1920, ge=16, le=16384)
    height: int = Field(default=1080, ge=16, le=16384)
    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Of red, green and blue light, 0 to 1: the brighter projector is dimmed."""
    blend: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    """The part of the picture, 0 to 1, over which light fades to its left, right, bottom and top edge."""
    monitor: str = ""
    """With `window = "each"`: part of the name of the monitor or projector it fills, or its number from 0."""
    at: tuple[int, int] | None = None
    """With `window = "each"` and no monitor: the upper left corner of its window on the desktop, pixels."""

    @model_validator(mode="after")
    def _a_rectangle(self) -> "Screen":
        across = [b - a for a, b in zip(self.lower_left, self.lower_right, strict=True)]
        up = [b - a for a, b in zip(self.lower_left, self.upper_left, strict=True)]
        w, h = math.hypot(*across), math.hypot(*up)
        if min(w, h) < 0.01:
            raise ValueError(f"screen {self.name}: {w:.3f} m wide and {h:.3f} m high; are two corners the same?")
        cosine = sum(a * b for a, b in zip(across, up, strict=True)) / (w * h)
        if abs(cosine) > 0.02:
            corners = "corners lie in one line, they" if abs(cosine) > 0.999 else "corners"
            angle = math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
            raise ValueError(
                f"screen {self.name}: its {corners} make no right angle at the lower left one ({angle:.0f} degrees);"
                " measure upper_left and lower_right again"
            )
        if not all(0.0 <= g <= 1.0 for g in self.gain):
            raise ValueError(f"screen {self.name}: gain: expected three numbers from 0 to 1, got {list(self.gain)}")
        if not all(0.0 <= b <= 0.5 for b in self.blend):
            raise ValueError(f"screen {self.name}: blend: expected four numbers from 0 to 0.5, got {list(self.blend)}")
        return self


class Display(Checked):
    """What a site sees."""

    width: int = Field(default=640, ge=16, le=16384)
    height: int = Field(default=360, ge=16, le=16384)
    window: bool | Literal["each"] = False
    """each: a window for each of `screens`."""
    view: Literal["seat", "room"] = "seat"
    screens: list[Screen] = Field(default=[])
    """A wall instead of a desktop: the first participant sees the room through these; width, height and view are theirs."""
    stereo: Literal["mono", "side_by_side", "top_bottom", "anaglyph", "sequential", "quad_buffer"] = "mono"
    eye_distance: float = Field(default=0.063, ge=0.0, le=0.2)
    """Between the viewer's pupils [m]."""
    convergence: float = Field(default=1.0, gt=0.05, le=100.0)
    """Stereo on a desktop: how far away things seem to lie on the display itself [m]."""
    video: bool = True
    """Write an MP4 of what is shown into the output folder."""
    stream: str = ""
    """Where browsers see it, "HOST:PORT", or a port of this machine only; "": nowhere."""
    stream_token: str = Field(default="", pattern=TOKEN)
    """What browsers show to see it; needed where other machines reach it: 16 to 64 letters, digits, _ and -."""
    stream_tls: StreamTls | None = None
    """Its certificate; without one, it makes its own where other machines reach it."""
    stream_insecure: bool = False
    """Plain HTTP beyond this machine is meant: everybody on the way reads token and picture."""
    shared_memory: bool = False
    """Other programs of its machine read it from memory (`vistel.wire.shared_pictures`)."""
    virtual_camera: str = ""
    """A v4l2loopback device that shows it as a camera: "auto", a path, or a part of a label; "": none."""
    frames_per_s: float = Field(default=30.0, gt=0, le=240)
    light: Literal["auto", "fast", "fine"] = "auto"
    """fine: soft shadows, and surfaces that mirror the room; auto: fine where a GPU draws, else fast."""
    resolution: Literal["auto", "full"] = "auto"
    """auto: where pictures take too long for `frames_per_s`, fewer pixels are drawn and enlarged."""
    engine: Literal["auto", "cpu", "gpu"] = "auto"
    """What deforms figures; auto: the GPU where one draws, else the CPU."""
    gauges: bool = False
    """Whether pictures a second and everybody's delay stand over the picture."""
    layers: bool = True
    """Whether muscles and bones show under figures' skins."""
    wrinkles: bool = True
    """Whether the clothes of built-in figures crease, and their faces."""

    @property
    def stream_at(self) -> tuple[str, int] | None:
        """Host and port of the stream."""
        return page_at(self.stream)

    @property
    def stream_https(self) -> bool:
        """Whether the stream is served over HTTPS."""
        return self.stream_tls is not None or not (self.stream_insecure or self._stream_is_local)

    @property
    def _stream_is_local(self) -> bool:
        return page_is_local(self.stream)

    @property
    def stream_page(self) -> str:
        """What a browser of the renderer's machine opens; empty for no stream, or for one at any free port."""
        return page_url(self.stream, https=self.stream_https)

    @field_validator("stream")
    @classmethod
    def _is_address(cls, stream: str) -> str:
        return checked_page(stream)

    @model_validator(mode="after")
    def _token_beyond_this_machine(self) -> "Display":
        if not self.stream_token and not self._stream_is_local:
            raise ValueError("stream: other machines reach it: expected stream_token that nobody guesses, of 16 letters or more")
        return self

    @model_validator(mode="after")
    def _plain_or_not(self) -> "Display":
        if self.stream_tls is not None and self.stream_insecure:
            raise ValueError("stream_insecure: is for plain HTTP, and stream_tls names a certificate; leave one of them out")
        return self

    @model_validator(mode="after")
    def _screens_apart(self) -> "Display":
        names = [screen.name for screen in self.screens]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"screens: {twice[0]} stands twice")
        both = 2 if self.stereo == "quad_buffer" else 1
        if both * sum(s.width for s in self.screens) > 16384:
            raise ValueError("screens: side by side they are wider than 16384 pixels")
        if self.window == "each" and not self.screens:
            raise ValueError('window = "each": there are no screens; add [[sites.display.screens]], or set window = true')
        return self
