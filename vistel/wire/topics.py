"""The one table of topics. Keys, access rules, the recorder, the console and the reference page come from it."""

import re
from dataclasses import dataclass
from enum import Enum
from functools import cache

from google.protobuf.message import Message

from vistel.v1 import audio_pb2, command_pb2, device_pb2, motion_pb2, service_pb2, speech_pb2, world_pb2

MESSAGE_VERSION = 1
"""`Header.version` of this package; a receiver drops and counts any other."""
_NAME = r"[a-z0-9][a-z0-9_\-]{0,79}"
"""What may stand in a key: names of the conference file have at most 32 letters, devices are named after them."""


class Delivery(Enum):
    """How a topic travels."""

    NEWEST = "newest"
    """Best effort; a slow or cut-off reader skips old values and never sees a stale one."""
    RELIABLE = "reliable"
    """Ordered, nothing lost while the sender lives; the last value of each key waits for late joiners."""
    QUERY = "query"
    """Asked for and answered (request, reply)."""


class Publisher(Enum):
    """Who may publish; the access rules are derived from it."""

    SITE = "site"
    WORLD = "world"
    HUB = "hub"


class Audience(Enum):
    """Who may subscribe to it, or ask for it; the access rules are derived from it too."""

    EVERYBODY = "everybody"
    """Observers too."""
    HOSTS = "hosts"
    """Those below, and the sites of the conference's hosts."""
    WORLDS = "worlds"
    """The hub, the world, and the sites on whose machines worlds run."""
    HUB = "hub"
    """The hub alone: who has its certificate, which is the host of the conference."""
    HOLDER = "holder"
    """Whoever has the certificate of the name {holder} in the key."""
    READER = "reader"
    """The site {reader_site} in the key, and the hub."""


@dataclass(frozen=True)
class Topic:
    """One row. `key` holds {conference} and, for publisher SITE, {site}; further names in braces are the topic's own."""

    name: str
    key: str
    message: type[Message]
    rate_hz: float
    """Nominal; 0 = on change."""
    delivery: Delivery
    publisher: Publisher
    recorded: bool
    about: str
    audience: Audience = Audience.EVERYBODY

    def format(self, **names: str) -> str:
        """The concrete key. Raises ValueError for a name that may not stand in a key."""
        for name, value in names.items():
            if not re.fullmatch(_NAME, value):
                raise ValueError(f"{name}: expected lower-case letters, digits, '-' or '_', got {value!r}")
        return self.key.format(**names)

    def pattern(self, conference: str = "*", **names: str) -> str:
        """A key expression that matches every key of this topic; names given narrow it."""
        filled = dict.fromkeys(self.fields, "*") | {"conference": conference} | names
        return self.key.format(**filled)

    @property
    def fields(self) -> tuple[str, ...]:
        """The names in braces, in order."""
        return tuple(re.findall(r"{(\w+)}", self.key))

    def match(self, key: str) -> dict[str, str] | None:
        """The names of a concrete key of this topic, or None for another topic's key."""
        found = _pattern(self.key).fullmatch(key)
        return found.groupdict() if found else None


@cache
def _pattern(key: str) -> re.Pattern[str]:
    return re.compile(re.sub(r"{(\w+)}", rf"(?P<\1>{_NAME})", key))


_SITE = "vistel/{conference}/site/{site}"
_WORLD = "vistel/{conference}/world"
_N = Delivery.NEWEST
_R = Delivery.RELIABLE
_Q = Delivery.QUERY
_S = Publisher.SITE
_W = Publisher.WORLD
_H = Publisher.HUB

TOPICS: tuple[Topic, ...] = (
    Topic("tracker", f"{_SITE}/device/{{device}}/tracker", device_pb2.TrackerFrame, 120, _N, _S, True,
          "receiver poses of a magnetic tracker"),
    Topic("glove", f"{_SITE}/device/{{device}}/glove", device_pb2.GloveFrame, 60, _N, _S, True,
          "sensors and joint angles of a glove"),
    Topic("face", f"{_SITE}/device/{{device}}/face", device_pb2.FaceFrame, 60, _N, _S, True,
          "marks of a face, gaze and lids"),
    Topic("pointer", f"{_SITE}/device/{{device}}/pointer", device_pb2.PointerFrame, 30, _N, _S, True,
          "what a guest does with mouse and keys, and who they are"),
    Topic("camera_body", f"{_SITE}/device/{{device}}/camera_body", device_pb2.CameraBodyFrame, 30, _N, _S, True,
          "landmarks of a guest that the camera of their page sees"),
    Topic("headset", f"{_SITE}/device/{{device}}/headset", device_pb2.HeadsetFrame, 30, _N, _S, True,
          "head and hands of a guest by the headset of their page"),
    Topic("device_status", f"{_SITE}/device/{{device}}/status", device_pb2.DeviceStatus, 1, _R, _S, True,
          "state and faults of a device"),
    Topic("device_raw", f"{_SITE}/device/{{device}}/raw", device_pb2.RawBytes, 0, _R, _S, True,
          "the bytes on a device's wire, published only if `record_raw` is on"),
    Topic("motion", f"{_SITE}/participant/{{participant}}/motion", motion_pb2.Motion, 60, _N, _S, True,
          "the posture of a participant"),
    Topic("motion_thin", f"{_SITE}/participant/{{participant}}/motion_thin", motion_pb2.Motion, 10, _N, _S, True,
          "the same, seldom, for those in a crowd who are far away; published where more than 12 take part"),
    Topic("participant", f"{_SITE}/participant/{{participant}}/about", motion_pb2.Participant, 0, _R, _S, True,
          "who a participant is"),
    Topic("avatar_part", f"{_SITE}/avatar/{{digest}}/{{part}}", motion_pb2.AvatarPart, 0, _R, _S, True,
          "a piece of a participant's own avatar"),
    Topic("picture_part", f"{_SITE}/picture/{{picture}}/{{part}}", motion_pb2.AvatarPart, 0, _R, _S, True,
          "a piece of a picture that a participant shows on a panel"),
    Topic("screen", f"{_SITE}/participant/{{participant}}/screen", motion_pb2.ScreenPart, 10, _N, _S, True,
          "what a participant shows live on a panel, encoded"),
    Topic("prop", f"{_SITE}/prop/{{thing}}/pose", motion_pb2.Prop, 60, _N, _S, True,
          "the pose of a prop"),
    Topic("image_delay", f"{_SITE}/renderer/delay", service_pb2.ImageDelay, 2, _N, _S, True,
          "how late the site's pictures are"),
    Topic("command", f"{_SITE}/participant/{{participant}}/command", command_pb2.Command, 0, _R, _S, True,
          "what a participant asks of the world"),
    Topic("voice", f"{_SITE}/participant/{{participant}}/voice", audio_pb2.Voice, 50, _N, _S, True,
          "the sound of a participant's microphone"),
    Topic("voice_level", f"{_SITE}/participant/{{participant}}/voice_level", audio_pb2.Voice, 4, _N, _S, True,
          "how loud a voice is, without its sound, for those in a crowd who do not hear it; while it sounds"),
    Topic("voice_control", f"{_SITE}/participant/{{participant}}/voice_control", audio_pb2.VoiceControl, 0, _R, _S, True,
          "whether a microphone is open"),
    Topic("sound", f"{_SITE}/audio/sound", audio_pb2.Sound, 50, _N, _S, False,
          "the mixed sound of a site"),
    Topic("sound_status", f"{_SITE}/audio/status", audio_pb2.SoundStatus, 4, _N, _S, True,
          "delays of voices, state of microphones and loudspeakers"),
    Topic("utterance", f"{_SITE}/participant/{{participant}}/utterance", speech_pb2.Utterance, 0, _R, _S, True,
          "a recognised utterance and its outcome"),
    Topic("chat", f"{_SITE}/participant/{{participant}}/chat", speech_pb2.ChatLine, 0, _R, _S, True,
          "a line that a participant wrote to all"),
    Topic("private_line", f"{_SITE}/participant/{{participant}}/private/{{reader_site}}/{{reader}}", speech_pb2.ChatLine, 0, _R, _S,
          False, "a line that a participant wrote to one other", Audience.READER),
    Topic("spoken_reply", f"{_SITE}/participant/{{participant}}/spoken_reply", audio_pb2.Voice, 50, _N, _S, False,
          "spoken answers of the room, played at the participant's site"),
    Topic("equipment_request", f"{_SITE}/equipment/{{equipment}}/request", audio_pb2.EquipmentRequest, 0, _R, _S, True,
          "a request to a device of the room"),
    Topic("equipment_status", f"{_SITE}/equipment/{{equipment}}/status", audio_pb2.EquipmentStatus, 1, _R, _S, True,
          "state of a device of the room"),
    Topic("heartbeat", f"{_SITE}/node/{{node}}/heartbeat", service_pb2.Heartbeat, 1, _N, _S, True,
          "a process is alive"),
    Topic("clock_offset", f"{_SITE}/node/{{node}}/clock", service_pb2.ClockOffset, 0.5, _N, _S, True,
          "a process's clock against conference time"),
    Topic("world_state", f"{_WORLD}/state", world_pb2.WorldState, 30, _N, _W, True,
          "the room as changes: motions, contacts, grasps; two steps in a message"),
    Topic("world_key", f"{_WORLD}/key", world_pb2.WorldState, 0.5, _R, _W, True,
          "the whole room; a re-run can begin there"),
    Topic("world_detail", f"{_WORLD}/detail/{{participant}}", world_pb2.WorldDetail, 30, _N, _W, True,
          "exact poses of things that `world_state` leaves to prediction, for one participant"),
    Topic("hand_force", f"{_WORLD}/force/{{participant}}/{{hand}}", world_pb2.HandForce, 60, _N, _W, True,
          "what a hand (left or right) that touches something feels"),
    Topic("world_inputs", f"{_WORLD}/inputs", world_pb2.WorldInputs, 60, _R, _W, True,
          "the inputs of each step, and once a second all that a world is made from", Audience.WORLDS),
    Topic("command_result", f"{_WORLD}/result/{{participant}}", command_pb2.CommandResult, 0, _R, _W, True,
          "the answer to a command"),
    Topic("ownership", f"{_WORLD}/ownership/{{participant}}", world_pb2.Ownership, 0, _R, _W, True,
          "the outcome of a participant's claims to held things"),
    Topic("bond_torn", f"{_WORLD}/bond_torn", world_pb2.BondTorn, 0, _R, _W, True,
          "a bond has torn, and with what force"),
    Topic("button", f"{_WORLD}/button", world_pb2.ButtonEvent, 0, _R, _W, True,
          "a button of the room was pressed or released, and by whom"),
    Topic("world_snapshot", f"{_WORLD}/snapshot", world_pb2.WorldSnapshot, 0, _Q, _W, True,
          "the whole room, for late joiners"),
    Topic("world_save", f"{_WORLD}/save", world_pb2.WorldSnapshot, 0, _Q, _W, False,
          "the whole room with all that a world is made from, to be kept", Audience.HOSTS),
    Topic("world_handover", f"{_WORLD}/handover", world_pb2.WorldHandover, 0, _Q, _W, False,
          "the room, for another world that takes it over", Audience.WORLDS),
    Topic("room_plan", f"{_WORLD}/plan", world_pb2.RoomPlan, 0, _Q, _W, False,
          "seats and walls of a room from a file, for sites that do not have it"),
    Topic("room_asset", f"{_WORLD}/asset", world_pb2.AssetPart, 0, _Q, _W, False,
          "polymeshes and pictures of things from files, by digest"),
    Topic("world_move", f"{_WORLD}/move", world_pb2.WorldMoveReply, 0, _Q, _W, False,
          "asks the world at a place to take the room over", Audience.HOSTS),
    Topic("note", "vistel/{conference}/note", service_pb2.Note, 0, _R, _H, True,
          "what the host wants to find again in the log"),
    Topic("host_action", "vistel/{conference}/host_action", service_pb2.HostAction, 0, _R, _H, True,
          "what the host did at the console, and what became of it"),
    Topic("muting", "vistel/{conference}/muting/{participant}", audio_pb2.Muting, 0, _R, _H, True,
          "the host closes a participant's microphone, which only the participant opens again"),
    Topic("clock", "vistel/{conference}/clock", service_pb2.ClockReply, 0, _Q, _H, False,
          "conference time"),
    Topic("fault", "vistel/{conference}/fault", service_pb2.FaultReply, 0, _Q, _H, False,
          "breaks something of a conference of `vistel up`, to see what it stands", Audience.HUB),
    Topic("run", "vistel/{conference}/run", service_pb2.RunReply, 0, _Q, _H, False,
          "starts and stops processes of a conference of `vistel up`, and tells of them", Audience.HUB),
    Topic("certificate", "vistel/{conference}/certificate/{holder}", service_pb2.CertificateReply, 0, _Q, _H, False,
          "a new certificate in place of one that will expire", Audience.HOLDER),
    Topic("revocations", "vistel/{conference}/revocations", service_pb2.Revocations, 0, _R, _H, False,
          "certificates that count no more, for routers without the authority's folder", Audience.HUB),
)  # fmt: skip

BY_NAME: dict[str, Topic] = {t.name: t for t in TOPICS}
