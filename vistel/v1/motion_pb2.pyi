from vistel.v1 import device_pb2 as _device_pb2
from vistel.v1 import envelope_pb2 as _envelope_pb2
from vistel.v1 import geometry_pb2 as _geometry_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Motion(_message.Message):
    __slots__ = ("header", "key_seq", "body", "hands", "stance", "gaze", "face", "stale", "frame", "earlier")
    class Earlier(_message.Message):
        __slots__ = ("back", "t_ns", "frame")
        BACK_FIELD_NUMBER: _ClassVar[int]
        T_NS_FIELD_NUMBER: _ClassVar[int]
        FRAME_FIELD_NUMBER: _ClassVar[int]
        back: int
        t_ns: int
        frame: bytes
        def __init__(self, back: _Optional[int] = ..., t_ns: _Optional[int] = ..., frame: _Optional[bytes] = ...) -> None: ...
    HEADER_FIELD_NUMBER: _ClassVar[int]
    KEY_SEQ_FIELD_NUMBER: _ClassVar[int]
    BODY_FIELD_NUMBER: _ClassVar[int]
    HANDS_FIELD_NUMBER: _ClassVar[int]
    STANCE_FIELD_NUMBER: _ClassVar[int]
    GAZE_FIELD_NUMBER: _ClassVar[int]
    FACE_FIELD_NUMBER: _ClassVar[int]
    STALE_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    EARLIER_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    key_seq: int
    body: _containers.RepeatedScalarFieldContainer[int]
    hands: _containers.RepeatedScalarFieldContainer[int]
    stance: _containers.RepeatedScalarFieldContainer[int]
    gaze: _containers.RepeatedScalarFieldContainer[int]
    face: _containers.RepeatedScalarFieldContainer[int]
    stale: int
    frame: bytes
    earlier: _containers.RepeatedCompositeFieldContainer[Motion.Earlier]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., key_seq: _Optional[int] = ..., body: _Optional[_Iterable[int]] = ..., hands: _Optional[_Iterable[int]] = ..., stance: _Optional[_Iterable[int]] = ..., gaze: _Optional[_Iterable[int]] = ..., face: _Optional[_Iterable[int]] = ..., stale: _Optional[int] = ..., frame: _Optional[bytes] = ..., earlier: _Optional[_Iterable[_Union[Motion.Earlier, _Mapping]]] = ...) -> None: ...

class Participant(_message.Message):
    __slots__ = ("header", "participant", "site", "display_name", "avatar", "height_m", "local_only", "parcel", "proportions", "left")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    SITE_FIELD_NUMBER: _ClassVar[int]
    DISPLAY_NAME_FIELD_NUMBER: _ClassVar[int]
    AVATAR_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_M_FIELD_NUMBER: _ClassVar[int]
    LOCAL_ONLY_FIELD_NUMBER: _ClassVar[int]
    PARCEL_FIELD_NUMBER: _ClassVar[int]
    PROPORTIONS_FIELD_NUMBER: _ClassVar[int]
    LEFT_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    participant: str
    site: str
    display_name: str
    avatar: str
    height_m: float
    local_only: bool
    parcel: str
    proportions: Proportions
    left: bool
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., participant: _Optional[str] = ..., site: _Optional[str] = ..., display_name: _Optional[str] = ..., avatar: _Optional[str] = ..., height_m: _Optional[float] = ..., local_only: _Optional[bool] = ..., parcel: _Optional[str] = ..., proportions: _Optional[_Union[Proportions, _Mapping]] = ..., left: _Optional[bool] = ...) -> None: ...

class Proportions(_message.Message):
    __slots__ = ("names", "joint", "rest", "tip", "a", "b", "radius_a", "radius_b")
    NAMES_FIELD_NUMBER: _ClassVar[int]
    JOINT_FIELD_NUMBER: _ClassVar[int]
    REST_FIELD_NUMBER: _ClassVar[int]
    TIP_FIELD_NUMBER: _ClassVar[int]
    A_FIELD_NUMBER: _ClassVar[int]
    B_FIELD_NUMBER: _ClassVar[int]
    RADIUS_A_FIELD_NUMBER: _ClassVar[int]
    RADIUS_B_FIELD_NUMBER: _ClassVar[int]
    names: _containers.RepeatedScalarFieldContainer[str]
    joint: _containers.RepeatedScalarFieldContainer[int]
    rest: _containers.RepeatedScalarFieldContainer[float]
    tip: _containers.RepeatedScalarFieldContainer[float]
    a: _containers.RepeatedScalarFieldContainer[float]
    b: _containers.RepeatedScalarFieldContainer[float]
    radius_a: _containers.RepeatedScalarFieldContainer[float]
    radius_b: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, names: _Optional[_Iterable[str]] = ..., joint: _Optional[_Iterable[int]] = ..., rest: _Optional[_Iterable[float]] = ..., tip: _Optional[_Iterable[float]] = ..., a: _Optional[_Iterable[float]] = ..., b: _Optional[_Iterable[float]] = ..., radius_a: _Optional[_Iterable[float]] = ..., radius_b: _Optional[_Iterable[float]] = ...) -> None: ...

class AvatarPart(_message.Message):
    __slots__ = ("header", "parts", "size", "data")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    PARTS_FIELD_NUMBER: _ClassVar[int]
    SIZE_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    parts: int
    size: int
    data: bytes
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., parts: _Optional[int] = ..., size: _Optional[int] = ..., data: _Optional[bytes] = ...) -> None: ...

class ScreenPart(_message.Message):
    __slots__ = ("header", "stream", "number", "part", "parts", "key", "codec", "width", "height", "t_us", "data")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    STREAM_FIELD_NUMBER: _ClassVar[int]
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    PART_FIELD_NUMBER: _ClassVar[int]
    PARTS_FIELD_NUMBER: _ClassVar[int]
    KEY_FIELD_NUMBER: _ClassVar[int]
    CODEC_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_FIELD_NUMBER: _ClassVar[int]
    T_US_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    stream: int
    number: int
    part: int
    parts: int
    key: bool
    codec: str
    width: int
    height: int
    t_us: int
    data: bytes
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., stream: _Optional[int] = ..., number: _Optional[int] = ..., part: _Optional[int] = ..., parts: _Optional[int] = ..., key: _Optional[bool] = ..., codec: _Optional[str] = ..., width: _Optional[int] = ..., height: _Optional[int] = ..., t_us: _Optional[int] = ..., data: _Optional[bytes] = ...) -> None: ...

class Prop(_message.Message):
    __slots__ = ("header", "thing", "pose", "health", "velocity", "spin", "led_by", "let_go")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    THING_FIELD_NUMBER: _ClassVar[int]
    POSE_FIELD_NUMBER: _ClassVar[int]
    HEALTH_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_FIELD_NUMBER: _ClassVar[int]
    SPIN_FIELD_NUMBER: _ClassVar[int]
    LED_BY_FIELD_NUMBER: _ClassVar[int]
    LET_GO_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    thing: str
    pose: _geometry_pb2.Pose
    health: _device_pb2.TrackerReceiver.Health
    velocity: _geometry_pb2.Vec3
    spin: _geometry_pb2.Vec3
    led_by: str
    let_go: bool
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., thing: _Optional[str] = ..., pose: _Optional[_Union[_geometry_pb2.Pose, _Mapping]] = ..., health: _Optional[_Union[_device_pb2.TrackerReceiver.Health, str]] = ..., velocity: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., spin: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., led_by: _Optional[str] = ..., let_go: _Optional[bool] = ...) -> None: ...
