from vistel.v1 import envelope_pb2 as _envelope_pb2
from vistel.v1 import geometry_pb2 as _geometry_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class TrackerReceiver(_message.Message):
    __slots__ = ("station", "position", "rotation", "health", "error", "t_ns")
    class Health(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        HEALTH_UNSPECIFIED: _ClassVar[TrackerReceiver.Health]
        HEALTH_GOOD: _ClassVar[TrackerReceiver.Health]
        HEALTH_FLAGGED: _ClassVar[TrackerReceiver.Health]
        HEALTH_UNTRUSTED: _ClassVar[TrackerReceiver.Health]
        HEALTH_FAULT: _ClassVar[TrackerReceiver.Health]
    HEALTH_UNSPECIFIED: TrackerReceiver.Health
    HEALTH_GOOD: TrackerReceiver.Health
    HEALTH_FLAGGED: TrackerReceiver.Health
    HEALTH_UNTRUSTED: TrackerReceiver.Health
    HEALTH_FAULT: TrackerReceiver.Health
    STATION_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    ROTATION_FIELD_NUMBER: _ClassVar[int]
    HEALTH_FIELD_NUMBER: _ClassVar[int]
    ERROR_FIELD_NUMBER: _ClassVar[int]
    T_NS_FIELD_NUMBER: _ClassVar[int]
    station: int
    position: _geometry_pb2.Vec3
    rotation: _geometry_pb2.Quaternion
    health: TrackerReceiver.Health
    error: str
    t_ns: int
    def __init__(self, station: _Optional[int] = ..., position: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., rotation: _Optional[_Union[_geometry_pb2.Quaternion, _Mapping]] = ..., health: _Optional[_Union[TrackerReceiver.Health, str]] = ..., error: _Optional[str] = ..., t_ns: _Optional[int] = ...) -> None: ...

class TrackerBone(_message.Message):
    __slots__ = ("joint", "position", "rotation")
    JOINT_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    ROTATION_FIELD_NUMBER: _ClassVar[int]
    joint: str
    position: _geometry_pb2.Vec3
    rotation: _geometry_pb2.Quaternion
    def __init__(self, joint: _Optional[str] = ..., position: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., rotation: _Optional[_Union[_geometry_pb2.Quaternion, _Mapping]] = ...) -> None: ...

class TrackerFrame(_message.Message):
    __slots__ = ("header", "device", "receivers", "bones")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    RECEIVERS_FIELD_NUMBER: _ClassVar[int]
    BONES_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    device: str
    receivers: _containers.RepeatedCompositeFieldContainer[TrackerReceiver]
    bones: _containers.RepeatedCompositeFieldContainer[TrackerBone]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., device: _Optional[str] = ..., receivers: _Optional[_Iterable[_Union[TrackerReceiver, _Mapping]]] = ..., bones: _Optional[_Iterable[_Union[TrackerBone, _Mapping]]] = ...) -> None: ...

class GloveFrame(_message.Message):
    __slots__ = ("header", "device", "right", "raw", "angles")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    RIGHT_FIELD_NUMBER: _ClassVar[int]
    RAW_FIELD_NUMBER: _ClassVar[int]
    ANGLES_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    device: str
    right: bool
    raw: bytes
    angles: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., device: _Optional[str] = ..., right: _Optional[bool] = ..., raw: _Optional[bytes] = ..., angles: _Optional[_Iterable[float]] = ...) -> None: ...

class FaceFrame(_message.Message):
    __slots__ = ("header", "device", "marks", "gaze", "channels", "lids", "guessed")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    MARKS_FIELD_NUMBER: _ClassVar[int]
    GAZE_FIELD_NUMBER: _ClassVar[int]
    CHANNELS_FIELD_NUMBER: _ClassVar[int]
    LIDS_FIELD_NUMBER: _ClassVar[int]
    GUESSED_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    device: str
    marks: _containers.RepeatedScalarFieldContainer[float]
    gaze: _containers.RepeatedScalarFieldContainer[float]
    channels: _containers.RepeatedScalarFieldContainer[float]
    lids: _containers.RepeatedScalarFieldContainer[float]
    guessed: int
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., device: _Optional[str] = ..., marks: _Optional[_Iterable[float]] = ..., gaze: _Optional[_Iterable[float]] = ..., channels: _Optional[_Iterable[float]] = ..., lids: _Optional[_Iterable[float]] = ..., guessed: _Optional[int] = ...) -> None: ...

class PointedHand(_message.Message):
    __slots__ = ("palm", "turn", "close")
    PALM_FIELD_NUMBER: _ClassVar[int]
    TURN_FIELD_NUMBER: _ClassVar[int]
    CLOSE_FIELD_NUMBER: _ClassVar[int]
    palm: _geometry_pb2.Vec3
    turn: float
    close: bool
    def __init__(self, palm: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., turn: _Optional[float] = ..., close: _Optional[bool] = ...) -> None: ...

class PointerFrame(_message.Message):
    __slots__ = ("header", "device", "gesture", "gesture_number", "head_yaw", "head_pitch", "left", "right", "guest")
    class Gesture(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        GESTURE_UNSPECIFIED: _ClassVar[PointerFrame.Gesture]
        GESTURE_WAVE: _ClassVar[PointerFrame.Gesture]
        GESTURE_NOD: _ClassVar[PointerFrame.Gesture]
        GESTURE_SHAKE: _ClassVar[PointerFrame.Gesture]
        GESTURE_POINT: _ClassVar[PointerFrame.Gesture]
        GESTURE_THUMBS_UP: _ClassVar[PointerFrame.Gesture]
        GESTURE_CLAP: _ClassVar[PointerFrame.Gesture]
    GESTURE_UNSPECIFIED: PointerFrame.Gesture
    GESTURE_WAVE: PointerFrame.Gesture
    GESTURE_NOD: PointerFrame.Gesture
    GESTURE_SHAKE: PointerFrame.Gesture
    GESTURE_POINT: PointerFrame.Gesture
    GESTURE_THUMBS_UP: PointerFrame.Gesture
    GESTURE_CLAP: PointerFrame.Gesture
    HEADER_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    GESTURE_FIELD_NUMBER: _ClassVar[int]
    GESTURE_NUMBER_FIELD_NUMBER: _ClassVar[int]
    HEAD_YAW_FIELD_NUMBER: _ClassVar[int]
    HEAD_PITCH_FIELD_NUMBER: _ClassVar[int]
    LEFT_FIELD_NUMBER: _ClassVar[int]
    RIGHT_FIELD_NUMBER: _ClassVar[int]
    GUEST_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    device: str
    gesture: PointerFrame.Gesture
    gesture_number: int
    head_yaw: float
    head_pitch: float
    left: PointedHand
    right: PointedHand
    guest: Guest
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., device: _Optional[str] = ..., gesture: _Optional[_Union[PointerFrame.Gesture, str]] = ..., gesture_number: _Optional[int] = ..., head_yaw: _Optional[float] = ..., head_pitch: _Optional[float] = ..., left: _Optional[_Union[PointedHand, _Mapping]] = ..., right: _Optional[_Union[PointedHand, _Mapping]] = ..., guest: _Optional[_Union[Guest, _Mapping]] = ...) -> None: ...

class Guest(_message.Message):
    __slots__ = ("display_name", "avatar", "left")
    DISPLAY_NAME_FIELD_NUMBER: _ClassVar[int]
    AVATAR_FIELD_NUMBER: _ClassVar[int]
    LEFT_FIELD_NUMBER: _ClassVar[int]
    display_name: str
    avatar: str
    left: bool
    def __init__(self, display_name: _Optional[str] = ..., avatar: _Optional[str] = ..., left: _Optional[bool] = ...) -> None: ...

class CameraBodyFrame(_message.Message):
    __slots__ = ("header", "device", "picture_t_ns", "calibrating", "body", "visibility", "left_hand", "right_hand", "face")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    PICTURE_T_NS_FIELD_NUMBER: _ClassVar[int]
    CALIBRATING_FIELD_NUMBER: _ClassVar[int]
    BODY_FIELD_NUMBER: _ClassVar[int]
    VISIBILITY_FIELD_NUMBER: _ClassVar[int]
    LEFT_HAND_FIELD_NUMBER: _ClassVar[int]
    RIGHT_HAND_FIELD_NUMBER: _ClassVar[int]
    FACE_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    device: str
    picture_t_ns: int
    calibrating: bool
    body: _containers.RepeatedScalarFieldContainer[int]
    visibility: _containers.RepeatedScalarFieldContainer[int]
    left_hand: _containers.RepeatedScalarFieldContainer[int]
    right_hand: _containers.RepeatedScalarFieldContainer[int]
    face: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., device: _Optional[str] = ..., picture_t_ns: _Optional[int] = ..., calibrating: _Optional[bool] = ..., body: _Optional[_Iterable[int]] = ..., visibility: _Optional[_Iterable[int]] = ..., left_hand: _Optional[_Iterable[int]] = ..., right_hand: _Optional[_Iterable[int]] = ..., face: _Optional[_Iterable[int]] = ...) -> None: ...

class HeadsetHand(_message.Message):
    __slots__ = ("confidence", "grip", "trigger", "squeeze", "joints")
    CONFIDENCE_FIELD_NUMBER: _ClassVar[int]
    GRIP_FIELD_NUMBER: _ClassVar[int]
    TRIGGER_FIELD_NUMBER: _ClassVar[int]
    SQUEEZE_FIELD_NUMBER: _ClassVar[int]
    JOINTS_FIELD_NUMBER: _ClassVar[int]
    confidence: int
    grip: _containers.RepeatedScalarFieldContainer[int]
    trigger: int
    squeeze: int
    joints: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, confidence: _Optional[int] = ..., grip: _Optional[_Iterable[int]] = ..., trigger: _Optional[int] = ..., squeeze: _Optional[int] = ..., joints: _Optional[_Iterable[int]] = ...) -> None: ...

class HeadsetFrame(_message.Message):
    __slots__ = ("header", "device", "poses_t_ns", "head", "confidence", "left", "right")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    POSES_T_NS_FIELD_NUMBER: _ClassVar[int]
    HEAD_FIELD_NUMBER: _ClassVar[int]
    CONFIDENCE_FIELD_NUMBER: _ClassVar[int]
    LEFT_FIELD_NUMBER: _ClassVar[int]
    RIGHT_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    device: str
    poses_t_ns: int
    head: _containers.RepeatedScalarFieldContainer[int]
    confidence: int
    left: HeadsetHand
    right: HeadsetHand
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., device: _Optional[str] = ..., poses_t_ns: _Optional[int] = ..., head: _Optional[_Iterable[int]] = ..., confidence: _Optional[int] = ..., left: _Optional[_Union[HeadsetHand, _Mapping]] = ..., right: _Optional[_Union[HeadsetHand, _Mapping]] = ...) -> None: ...

class RawBytes(_message.Message):
    __slots__ = ("header", "device", "direction", "data", "read_size", "read_after_ns")
    class Direction(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        DIRECTION_UNSPECIFIED: _ClassVar[RawBytes.Direction]
        DIRECTION_FROM_DEVICE: _ClassVar[RawBytes.Direction]
        DIRECTION_TO_DEVICE: _ClassVar[RawBytes.Direction]
    DIRECTION_UNSPECIFIED: RawBytes.Direction
    DIRECTION_FROM_DEVICE: RawBytes.Direction
    DIRECTION_TO_DEVICE: RawBytes.Direction
    HEADER_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    DIRECTION_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    READ_SIZE_FIELD_NUMBER: _ClassVar[int]
    READ_AFTER_NS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    device: str
    direction: RawBytes.Direction
    data: bytes
    read_size: _containers.RepeatedScalarFieldContainer[int]
    read_after_ns: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., device: _Optional[str] = ..., direction: _Optional[_Union[RawBytes.Direction, str]] = ..., data: _Optional[bytes] = ..., read_size: _Optional[_Iterable[int]] = ..., read_after_ns: _Optional[_Iterable[int]] = ...) -> None: ...

class DeviceStatus(_message.Message):
    __slots__ = ("header", "device", "state", "detail", "rate_hz", "frames", "bytes_skipped", "reconnects")
    class State(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        STATE_UNSPECIFIED: _ClassVar[DeviceStatus.State]
        STATE_SEARCHING: _ClassVar[DeviceStatus.State]
        STATE_STARTING: _ClassVar[DeviceStatus.State]
        STATE_STREAMING: _ClassVar[DeviceStatus.State]
        STATE_STALLED: _ClassVar[DeviceStatus.State]
        STATE_FAULT: _ClassVar[DeviceStatus.State]
        STATE_ABSENT: _ClassVar[DeviceStatus.State]
    STATE_UNSPECIFIED: DeviceStatus.State
    STATE_SEARCHING: DeviceStatus.State
    STATE_STARTING: DeviceStatus.State
    STATE_STREAMING: DeviceStatus.State
    STATE_STALLED: DeviceStatus.State
    STATE_FAULT: DeviceStatus.State
    STATE_ABSENT: DeviceStatus.State
    HEADER_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    BYTES_SKIPPED_FIELD_NUMBER: _ClassVar[int]
    RECONNECTS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    device: str
    state: DeviceStatus.State
    detail: str
    rate_hz: float
    frames: int
    bytes_skipped: int
    reconnects: int
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., device: _Optional[str] = ..., state: _Optional[_Union[DeviceStatus.State, str]] = ..., detail: _Optional[str] = ..., rate_hz: _Optional[float] = ..., frames: _Optional[int] = ..., bytes_skipped: _Optional[int] = ..., reconnects: _Optional[int] = ...) -> None: ...
