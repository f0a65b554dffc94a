"""What a window shows about the conference beside its picture: the state of sites, delays of voices, answers."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from vistel.v1 import audio_pb2, command_pb2, device_pb2, service_pb2

SILENT_NS = 3_500_000_000
"""A site whose processes have said nothing for so long is not there."""
NOTICE_NS = 6_000_000_000
"""How long an answer stands."""


@dataclass(frozen=True)
class SiteStatus:
    """A site. people: who are at it; heard_ns: when one of its processes was last heard [ns]; rate: pictures a second; delay:
    of the picture that is shown there, the latest person's [s]; devices: all of its, and faults: what is wrong with them."""

    name: str
    people: tuple[str, ...] = ()
    heard_ns: int = 0
    rate: float = 0.0
    delay: float = 0.0
    devices: int = 0
    faults: tuple[str, ...] = ()

    def state(self, now_ns: int) -> str:
        """Its state, in a word or two."""
        if not self.heard_ns:
            return "awaited"
        if now_ns - self.heard_ns > SILENT_NS:
            return f"silent {(now_ns - self.heard_ns) * 1e-9:.0f} s"
        return f"{len(self.faults)} of {self.devices} devices" if self.faults else "well"


@dataclass(frozen=True)
class ConferenceStatus:
    """skew: how much later than their picture people are heard here [s]; notice: one line, and warning: whether it warns;
    film: name of the file that is recorded, empty for none."""

    sites: tuple[SiteStatus, ...] = ()
    skew: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    notice: str = ""
    warning: bool = False
    film: str = ""


class StatusCollector:
    """Collects the status from messages. sites: of the conference and who is at each, as the file says."""

    def __init__(self, sites: Mapping[str, tuple[str, ...]]) -> None:
        self._sites = {name: SiteStatus(name, people) for name, people in sites.items()}
        self._devices: dict[str, dict[str, str]] = {}
        self._skew: Mapping[str, float] = MappingProxyType({})
        self._notice, self._warning, self._noticed_ns = "", False, 0

    def heartbeat(self, site: str, received_ns: int) -> None:
        """A process of a site runs."""
        self._change(site, heard_ns=received_ns)

    def image_delay(self, site: str, message: service_pb2.ImageDelay) -> None:
        """How late a site's pictures are."""
        self._change(site, rate=message.frames_per_s, delay=max((s.delay_s for s in message.streams), default=0.0))

    def device(self, site: str, message: device_pb2.DeviceStatus) -> None:
        """How a device is doing."""
        states, known = device_pb2.DeviceStatus, self._devices.setdefault(site, {})
        if message.state == states.STATE_ABSENT:
            known.pop(message.device, None)
        else:
            fine = message.state in (states.STATE_STREAMING, states.STATE_STARTING)
            known[message.device] = "" if fine else f"{message.device}: {message.detail or 'silent'}"
        self._change(site, devices=len(known), faults=tuple(fault for _, fault in sorted(known.items()) if fault))

    def person(self, site: str, name: str) -> None:
        """Somebody is at a site."""
        people = self._sites[site].people if site in self._sites else ()
        if name not in people:
            self._change(site, people=(*people, name))

    def sound(self, message: audio_pb2.SoundStatus) -> None:
        """How late voices are here."""
        self._skew = MappingProxyType({s.participant: s.skew_s for s in message.streams if s.HasField("skew_s")})

    def answer(self, message: command_pb2.CommandResult, received_ns: int) -> None:
        """What became of a command."""
        if message.outcome == command_pb2.CommandResult.OUTCOME_REFUSED:
            self.notice(message.reason, received_ns, warning=True)

    def notice(self, text: str, now_ns: int, warning: bool = False) -> None:
        """Show this for a while."""
        self._notice, self._warning, self._noticed_ns = text, warning, now_ns

    def now(self, now_ns: int, film: str) -> ConferenceStatus:
        """What is known."""
        if now_ns - self._noticed_ns > NOTICE_NS:
            self._notice = ""
        return ConferenceStatus(tuple(self._sites.values()), self._skew, self._notice, self._warning, film)

    def _change(self, site: str, **news: object) -> None:
        self._sites[site] = replace(self._sites.get(site, SiteStatus(site)), **news)  # type: ignore[arg-type]
