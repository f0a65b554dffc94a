from vistel.v1 import envelope_pb2 as _envelope_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Voice(_message.Message):
    __slots__ = ("header", "opus", "level_db", "clipped", "talking", "earlier", "visemes")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    OPUS_FIELD_NUMBER: _ClassVar[int]
    LEVEL_DB_FIELD_NUMBER: _ClassVar[int]
    CLIPPED_FIELD_NUMBER: _ClassVar[int]
    TALKING_FIELD_NUMBER: _ClassVar[int]
    EARLIER_FIELD_NUMBER: _ClassVar[int]
    VISEMES_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    opus: bytes
    level_db: float
    clipped: bool
    talking: bool
    earlier: _containers.RepeatedScalarFieldContainer[bytes]
    visemes: bytes
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., opus: _Optional[bytes] = ..., level_db: _Optional[float] = ..., clipped: _Optional[bool] = ..., talking: _Optional[bool] = ..., earlier: _Optional[_Iterable[bytes]] = ..., visemes: _Optional[bytes] = ...) -> None: ...

class VoiceControl(_message.Message):
    __slots__ = ("header", "participant", "muted", "push_to_talk", "talk")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    MUTED_FIELD_NUMBER: _ClassVar[int]
    PUSH_TO_TALK_FIELD_NUMBER: _ClassVar[int]
    TALK_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    participant: str
    muted: bool
    push_to_talk: bool
    talk: bool
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., participant: _Optional[str] = ..., muted: _Optional[bool] = ..., push_to_talk: _Optional[bool] = ..., talk: _Optional[bool] = ...) -> None: ...

class Muting(_message.Message):
    __slots__ = ("header", "participant")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    participant: str
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., participant: _Optional[str] = ...) -> None: ...

class Sound(_message.Message):
    __slots__ = ("header", "opus")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    OPUS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    opus: bytes
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., opus: _Optional[bytes] = ...) -> None: ...

class SoundStatus(_message.Message):
    __slots__ = ("header", "site", "policy", "streams", "microphones", "loudspeaker", "loudspeaker_detail", "output_s", "acoustic_known")
    class Stream(_message.Message):
        __slots__ = ("participant", "target_s", "actual_s", "image_s", "skew_s", "needed_s", "talking", "level_db", "frames", "concealed", "drift_ppm")
        PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
        TARGET_S_FIELD_NUMBER: _ClassVar[int]
        ACTUAL_S_FIELD_NUMBER: _ClassVar[int]
        IMAGE_S_FIELD_NUMBER: _ClassVar[int]
        SKEW_S_FIELD_NUMBER: _ClassVar[int]
        NEEDED_S_FIELD_NUMBER: _ClassVar[int]
        TALKING_FIELD_NUMBER: _ClassVar[int]
        LEVEL_DB_FIELD_NUMBER: _ClassVar[int]
        FRAMES_FIELD_NUMBER: _ClassVar[int]
        CONCEALED_FIELD_NUMBER: _ClassVar[int]
        DRIFT_PPM_FIELD_NUMBER: _ClassVar[int]
        participant: str
        target_s: float
        actual_s: float
        image_s: float
        skew_s: float
        needed_s: float
        talking: bool
        level_db: float
        frames: int
        concealed: int
        drift_ppm: float
        def __init__(self, participant: _Optional[str] = ..., target_s: _Optional[float] = ..., actual_s: _Optional[float] = ..., image_s: _Optional[float] = ..., skew_s: _Optional[float] = ..., needed_s: _Optional[float] = ..., talking: _Optional[bool] = ..., level_db: _Optional[float] = ..., frames: _Optional[int] = ..., concealed: _Optional[int] = ..., drift_ppm: _Optional[float] = ...) -> None: ...
    class Microphone(_message.Message):
        __slots__ = ("participant", "source", "open", "muted", "push_to_talk", "level_db", "clipped", "detail", "rate_hz")
        PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
        SOURCE_FIELD_NUMBER: _ClassVar[int]
        OPEN_FIELD_NUMBER: _ClassVar[int]
        MUTED_FIELD_NUMBER: _ClassVar[int]
        PUSH_TO_TALK_FIELD_NUMBER: _ClassVar[int]
        LEVEL_DB_FIELD_NUMBER: _ClassVar[int]
        CLIPPED_FIELD_NUMBER: _ClassVar[int]
        DETAIL_FIELD_NUMBER: _ClassVar[int]
        RATE_HZ_FIELD_NUMBER: _ClassVar[int]
        participant: str
        source: str
        open: bool
        muted: bool
        push_to_talk: bool
        level_db: float
        clipped: bool
        detail: str
        rate_hz: float
        def __init__(self, participant: _Optional[str] = ..., source: _Optional[str] = ..., open: _Optional[bool] = ..., muted: _Optional[bool] = ..., push_to_talk: _Optional[bool] = ..., level_db: _Optional[float] = ..., clipped: _Optional[bool] = ..., detail: _Optional[str] = ..., rate_hz: _Optional[float] = ...) -> None: ...
    HEADER_FIELD_NUMBER: _ClassVar[int]
    SITE_FIELD_NUMBER: _ClassVar[int]
    POLICY_FIELD_NUMBER: _ClassVar[int]
    STREAMS_FIELD_NUMBER: _ClassVar[int]
    MICROPHONES_FIELD_NUMBER: _ClassVar[int]
    LOUDSPEAKER_FIELD_NUMBER: _ClassVar[int]
    LOUDSPEAKER_DETAIL_FIELD_NUMBER: _ClassVar[int]
    OUTPUT_S_FIELD_NUMBER: _ClassVar[int]
    ACOUSTIC_KNOWN_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    site: str
    policy: str
    streams: _containers.RepeatedCompositeFieldContainer[SoundStatus.Stream]
    microphones: _containers.RepeatedCompositeFieldContainer[SoundStatus.Microphone]
    loudspeaker: str
    loudspeaker_detail: str
    output_s: float
    acoustic_known: bool
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., site: _Optional[str] = ..., policy: _Optional[str] = ..., streams: _Optional[_Iterable[_Union[SoundStatus.Stream, _Mapping]]] = ..., microphones: _Optional[_Iterable[_Union[SoundStatus.Microphone, _Mapping]]] = ..., loudspeaker: _Optional[str] = ..., loudspeaker_detail: _Optional[str] = ..., output_s: _Optional[float] = ..., acoustic_known: _Optional[bool] = ...) -> None: ...

class EquipmentRequest(_message.Message):
    __slots__ = ("header", "equipment", "settings")
    class Setting(_message.Message):
        __slots__ = ("name", "value")
        NAME_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        name: str
        value: float
        def __init__(self, name: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    HEADER_FIELD_NUMBER: _ClassVar[int]
    EQUIPMENT_FIELD_NUMBER: _ClassVar[int]
    SETTINGS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    equipment: str
    settings: _containers.RepeatedCompositeFieldContainer[EquipmentRequest.Setting]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., equipment: _Optional[str] = ..., settings: _Optional[_Iterable[_Union[EquipmentRequest.Setting, _Mapping]]] = ...) -> None: ...

class EquipmentStatus(_message.Message):
    __slots__ = ("header", "equipment", "state", "detail", "values", "delay_known", "acoustic_s", "reconnects", "refusals")
    class State(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        STATE_UNSPECIFIED: _ClassVar[EquipmentStatus.State]
        STATE_SEARCHING: _ClassVar[EquipmentStatus.State]
        STATE_OBSERVED: _ClassVar[EquipmentStatus.State]
        STATE_SETTLING: _ClassVar[EquipmentStatus.State]
        STATE_UNKNOWN: _ClassVar[EquipmentStatus.State]
        STATE_FAULT: _ClassVar[EquipmentStatus.State]
    STATE_UNSPECIFIED: EquipmentStatus.State
    STATE_SEARCHING: EquipmentStatus.State
    STATE_OBSERVED: EquipmentStatus.State
    STATE_SETTLING: EquipmentStatus.State
    STATE_UNKNOWN: EquipmentStatus.State
    STATE_FAULT: EquipmentStatus.State
    class Value(_message.Message):
        __slots__ = ("name", "observed", "desired", "asked", "unit")
        NAME_FIELD_NUMBER: _ClassVar[int]
        OBSERVED_FIELD_NUMBER: _ClassVar[int]
        DESIRED_FIELD_NUMBER: _ClassVar[int]
        ASKED_FIELD_NUMBER: _ClassVar[int]
        UNIT_FIELD_NUMBER: _ClassVar[int]
        name: str
        observed: float
        desired: float
        asked: bool
        unit: str
        def __init__(self, name: _Optional[str] = ..., observed: _Optional[float] = ..., desired: _Optional[float] = ..., asked: _Optional[bool] = ..., unit: _Optional[str] = ...) -> None: ...
    HEADER_FIELD_NUMBER: _ClassVar[int]
    EQUIPMENT_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    VALUES_FIELD_NUMBER: _ClassVar[int]
    DELAY_KNOWN_FIELD_NUMBER: _ClassVar[int]
    ACOUSTIC_S_FIELD_NUMBER: _ClassVar[int]
    RECONNECTS_FIELD_NUMBER: _ClassVar[int]
    REFUSALS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    equipment: str
    state: EquipmentStatus.State
    detail: str
    values: _containers.RepeatedCompositeFieldContainer[EquipmentStatus.Value]
    delay_known: bool
    acoustic_s: float
    reconnects: int
    refusals: int
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., equipment: _Optional[str] = ..., state: _Optional[_Union[EquipmentStatus.State, str]] = ..., detail: _Optional[str] = ..., values: _Optional[_Iterable[_Union[EquipmentStatus.Value, _Mapping]]] = ..., delay_known: _Optional[bool] = ..., acoustic_s: _Optional[float] = ..., reconnects: _Optional[int] = ..., refusals: _Optional[int] = ...) -> None: ...
