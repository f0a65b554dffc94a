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
    __slots__ = ("header", "key_seq", "body", "hands", "stance", "gaze", "face", "stale", "lids")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    KEY_SEQ_FIELD_NUMBER: _ClassVar[int]
    BODY_FIELD_NUMBER: _ClassVar[int]
    HANDS_FIELD_NUMBER: _ClassVar[int]
    STANCE_FIELD_NUMBER: _ClassVar[int]
    GAZE_FIELD_NUMBER: _ClassVar[int]
    FACE_FIELD_NUMBER: _ClassVar[int]
    STALE_FIELD_NUMBER: _ClassVar[int]
    LIDS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    key_seq: int
    body: _containers.RepeatedScalarFieldContainer[int]
    hands: _containers.RepeatedScalarFieldContainer[int]
    stance: _containers.RepeatedScalarFieldContainer[int]
    gaze: _containers.RepeatedScalarFieldContainer[int]
    face: _containers.RepeatedScalarFieldContainer[int]
    stale: int
    lids: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., key_seq: _Optional[int] = ..., body: _Optional[_Iterable[int]] = ..., hands: _Optional[_Iterable[int]] = ..., stance: _Optional[_Iterable[int]] = ..., gaze: _Optional[_Iterable[int]] = ..., face: _Optional[_Iterable[int]] = ..., stale: _Optional[int] = ..., lids: _Optional[_Iterable[int]] = ...) -> None: ...

class Participant(_message.Message):
    __slots__ = ("header", "participant", "site", "display_name", "avatar", "height_m", "local_only")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    SITE_FIELD_NUMBER: _ClassVar[int]
    DISPLAY_NAME_FIELD_NUMBER: _ClassVar[int]
    AVATAR_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_M_FIELD_NUMBER: _ClassVar[int]
    LOCAL_ONLY_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    participant: str
    site: str
    display_name: str
    avatar: str
    height_m: float
    local_only: bool
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., participant: _Optional[str] = ..., site: _Optional[str] = ..., display_name: _Optional[str] = ..., avatar: _Optional[str] = ..., height_m: _Optional[float] = ..., local_only: _Optional[bool] = ...) -> None: ...

class Prop(_message.Message):
    __slots__ = ("header", "thing", "pose", "health", "velocity", "spin")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    THING_FIELD_NUMBER: _ClassVar[int]
    POSE_FIELD_NUMBER: _ClassVar[int]
    HEALTH_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_FIELD_NUMBER: _ClassVar[int]
    SPIN_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    thing: str
    pose: _geometry_pb2.Pose
    health: _device_pb2.TrackerReceiver.Health
    velocity: _geometry_pb2.Vec3
    spin: _geometry_pb2.Vec3
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., thing: _Optional[str] = ..., pose: _Optional[_Union[_geometry_pb2.Pose, _Mapping]] = ..., health: _Optional[_Union[_device_pb2.TrackerReceiver.Health, str]] = ..., velocity: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., spin: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ...) -> None: ...
