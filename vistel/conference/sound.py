"""A site's sound in a conference file: microphones, loudspeaker, how long voices are delayed, the room's equipment."""

import re
from typing import Literal

from pydantic import Field, field_validator, model_validator

from vistel.audio.delay_policy import Policy, read_policy
from vistel.audio.spatial_mode import SpatialMode
from vistel.conference.devices import Checked, Name
from vistel.protocol.equipment import DELAY_UNIT, Kind, Register, Table


class RegisterConfig(Checked):
    """One register of a device."""

    table: Table
    address: int = Field(ge=0, le=0xFFFF)
    """On the wire, from 0: holding register 40001 of a manual is 0 here."""
    kind: Kind | None = None
    """Default: "u16", of coils and discrete inputs "bit"."""
    scale: float = 1.0
    """What one count means, in `unit`."""
    unit: str = ""
    low: float | None = None
    high: float | None = None
    """What may be asked of it, in `unit`."""

    @model_validator(mode="after")
    def _can_be(self) -> "RegisterConfig":
        single = self.table in ("coil", "discrete")
        if self.kind is not None and single != (self.kind == "bit"):
            raise ValueError(f"kind: a {self.table} holds {'bits' if single else 'u16, i16 or u32'}; got {self.kind!r}")
        if self.scale == 0.0:
            raise ValueError("scale: expected a number other than 0")
        return self

    def register(self) -> Register:
        """As the protocol takes it."""
        kind = self.kind or ("bit" if self.table in ("coil", "discrete") else "u16")
        return Register(self.table, self.address, kind, self.scale, self.unit, self.low, self.high)


class Equipment(Checked):
    """A device of the room on Modbus."""

    name: Name
    role: Literal["delay", "other"] = "other"
    """delay: what is played at the site goes through it."""
    address: str = "sim"
    """"tcp:HOST:PORT", "rtu:SERIAL PORT", "rtu+tcp:HOST:PORT" (a serial line behind a gateway); "sim" for a simulated device
    on TCP, "sim:rtu" for one on a serial line."""
    device_id: int = Field(default=1, ge=0, le=247)
    baud: int = 19200
    parity: Literal["N", "E", "O"] = "E"
    channel: int = Field(default=1, ge=1, le=8)
    """delay: which of the unit's channels the loudspeaker is on."""
    registers: dict[str, RegisterConfig] = Field(default={})
    """By a name of one's own. A delay unit has a map; what is given here replaces entries of it."""
    settings: dict[str, float] = Field(default={})
    """What these registers are to hold, in their units, from the start."""

    @field_validator("address")
    @classmethod
    def _an_address(cls, address: str) -> str:
        if not re.fullmatch(r"sim(:rtu)?|rtu:.+|(tcp|rtu\+tcp):.+:\d{1,5}", address):
            known = '"tcp:HOST:PORT", "rtu:SERIAL PORT", "rtu+tcp:HOST:PORT", "sim" or "sim:rtu"'
            raise ValueError(f"expected {known}, got {address!r}")
        return address

    @model_validator(mode="after")
    def _can_be(self) -> "Equipment":
        known = self.map()
        if not known:
            raise ValueError("registers: expected at least one; nothing is known of this device")
        for name, value in self.settings.items():
            if name not in known or not known[name].writable:
                may = ", ".join(n for n, r in known.items() if r.writable)
                raise ValueError(f"settings.{name}: no register that can be written; there are {may}")
            try:
                known[name].raw(value)
            except ValueError as e:
                raise ValueError(f"settings.{name}: {e}") from e
        return self

    @property
    def simulated(self) -> bool:
        """Whether there is no such device."""
        return self.address.startswith("sim")

    def map(self) -> dict[str, Register]:
        """Its registers by name."""
        own = {name: r.register() for name, r in self.registers.items()}
        return (dict(DELAY_UNIT) if self.role == "delay" else {}) | own


class Audio(Checked):
    """Loudspeakers, microphones and the equipment of a site's room."""

    microphone: str = "sim"
    """"sim" (a simulated talker), "default" (the system's), "none", a part of a device's name, a WAV file, or the path of a
    pipe with 16-bit samples at 48 kHz."""
    microphones: dict[Name, str] = Field(default={})
    """By participant, for those who have one of their own; `microphone` is the first participant's."""
    loudspeaker: str = "auto"
    """"auto" (the system's, where there is one), "none", a part of a device's name, or a .wav file to write."""
    delay: str = "match"
    """How long voices are held back: "match" (each to the picture of its talker) or "fixed SECONDS"."""
    spatial: SpatialMode = "pan"
    """How voices come from where their talkers are: "pan" (for loudspeakers), "hrtf" (for headphones) or "off"."""
    push_to_talk: bool = False
    """Whether microphones are open only while a button is held."""
    stream: bool = True
    """Whether the mixed sound is published, for the site's video and other subscribers."""
    bitrate: int = Field(default=24_000, ge=6_000, le=128_000)
    repeats: int = Field(default=1, ge=0, le=3)
    """How many of the frames before it each message carries once more: what a link loses comes with its successor."""
    latency: float = Field(default=0.0, ge=0.0, le=1.0)
    """Seconds from loudspeaker output to ear that the sound card does not know of: amplifiers, wireless headphones."""
    equipment: list[Equipment] = Field(default=[])

    @field_validator("spatial", mode="before")
    @classmethod
    def _yes_or_no(cls, spatial: object) -> object:
        return {True: "pan", False: "off"}[spatial] if isinstance(spatial, bool) else spatial

    @field_validator("delay")
    @classmethod
    def _a_policy(cls, delay: str) -> str:
        read_policy(delay)
        return delay

    @model_validator(mode="after")
    def _one_delay_unit(self) -> "Audio":
        if sum(e.role == "delay" for e in self.equipment) > 1:
            raise ValueError("equipment: one delay unit at most; what is played goes through it")
        names = [e.name for e in self.equipment]
        if len(set(names)) < len(names):
            raise ValueError("equipment: each must have a name of its own")
        return self

    @property
    def policy(self) -> Policy:
        """`delay`, parsed."""
        return read_policy(self.delay)

    def microphone_of(self, participant: str, first: bool) -> str:
        """What `participant` speaks into; first: whether they are the site's first."""
        return self.microphones.get(participant, self.microphone if first else "none")
