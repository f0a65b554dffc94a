from vistel.v1 import envelope_pb2 as _envelope_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class ImageDelay(_message.Message):
    __slots__ = ("header", "site", "streams", "frames_per_s", "frame_time_s", "frames", "stand_ins")
    class Stream(_message.Message):
        __slots__ = ("participant", "delay_s", "age_s", "jitter_s", "shown_ns", "playout_s", "towards_s", "rate")
        PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
        DELAY_S_FIELD_NUMBER: _ClassVar[int]
        AGE_S_FIELD_NUMBER: _ClassVar[int]
        JITTER_S_FIELD_NUMBER: _ClassVar[int]
        SHOWN_NS_FIELD_NUMBER: _ClassVar[int]
        PLAYOUT_S_FIELD_NUMBER: _ClassVar[int]
        TOWARDS_S_FIELD_NUMBER: _ClassVar[int]
        RATE_FIELD_NUMBER: _ClassVar[int]
        participant: str
        delay_s: float
        age_s: float
        jitter_s: float
        shown_ns: int
        playout_s: float
        towards_s: float
        rate: float
        def __init__(self, participant: _Optional[str] = ..., delay_s: _Optional[float] = ..., age_s: _Optional[float] = ..., jitter_s: _Optional[float] = ..., shown_ns: _Optional[int] = ..., playout_s: _Optional[float] = ..., towards_s: _Optional[float] = ..., rate: _Optional[float] = ...) -> None: ...
    HEADER_FIELD_NUMBER: _ClassVar[int]
    SITE_FIELD_NUMBER: _ClassVar[int]
    STREAMS_FIELD_NUMBER: _ClassVar[int]
    FRAMES_PER_S_FIELD_NUMBER: _ClassVar[int]
    FRAME_TIME_S_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    STAND_INS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    site: str
    streams: _containers.RepeatedCompositeFieldContainer[ImageDelay.Stream]
    frames_per_s: float
    frame_time_s: float
    frames: int
    stand_ins: int
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., site: _Optional[str] = ..., streams: _Optional[_Iterable[_Union[ImageDelay.Stream, _Mapping]]] = ..., frames_per_s: _Optional[float] = ..., frame_time_s: _Optional[float] = ..., frames: _Optional[int] = ..., stand_ins: _Optional[int] = ...) -> None: ...

class ClockProbe(_message.Message):
    __slots__ = ("t_client_ns", "release", "message_version", "padding", "reply_bytes", "sites")
    T_CLIENT_NS_FIELD_NUMBER: _ClassVar[int]
    RELEASE_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_VERSION_FIELD_NUMBER: _ClassVar[int]
    PADDING_FIELD_NUMBER: _ClassVar[int]
    REPLY_BYTES_FIELD_NUMBER: _ClassVar[int]
    SITES_FIELD_NUMBER: _ClassVar[int]
    t_client_ns: int
    release: str
    message_version: int
    padding: bytes
    reply_bytes: int
    sites: bool
    def __init__(self, t_client_ns: _Optional[int] = ..., release: _Optional[str] = ..., message_version: _Optional[int] = ..., padding: _Optional[bytes] = ..., reply_bytes: _Optional[int] = ..., sites: _Optional[bool] = ...) -> None: ...

class ClockReply(_message.Message):
    __slots__ = ("t_client_ns", "t_server_ns", "release", "message_version", "padding", "sites")
    T_CLIENT_NS_FIELD_NUMBER: _ClassVar[int]
    T_SERVER_NS_FIELD_NUMBER: _ClassVar[int]
    RELEASE_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_VERSION_FIELD_NUMBER: _ClassVar[int]
    PADDING_FIELD_NUMBER: _ClassVar[int]
    SITES_FIELD_NUMBER: _ClassVar[int]
    t_client_ns: int
    t_server_ns: int
    release: str
    message_version: int
    padding: bytes
    sites: _containers.RepeatedCompositeFieldContainer[SiteDigest]
    def __init__(self, t_client_ns: _Optional[int] = ..., t_server_ns: _Optional[int] = ..., release: _Optional[str] = ..., message_version: _Optional[int] = ..., padding: _Optional[bytes] = ..., sites: _Optional[_Iterable[_Union[SiteDigest, _Mapping]]] = ...) -> None: ...

class SiteDigest(_message.Message):
    __slots__ = ("site", "digest")
    SITE_FIELD_NUMBER: _ClassVar[int]
    DIGEST_FIELD_NUMBER: _ClassVar[int]
    site: str
    digest: bytes
    def __init__(self, site: _Optional[str] = ..., digest: _Optional[bytes] = ...) -> None: ...

class ClockOffset(_message.Message):
    __slots__ = ("header", "node", "offset_ns", "uncertainty_ns")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    NODE_FIELD_NUMBER: _ClassVar[int]
    OFFSET_NS_FIELD_NUMBER: _ClassVar[int]
    UNCERTAINTY_NS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    node: str
    offset_ns: int
    uncertainty_ns: int
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., node: _Optional[str] = ..., offset_ns: _Optional[int] = ..., uncertainty_ns: _Optional[int] = ...) -> None: ...

class Heartbeat(_message.Message):
    __slots__ = ("header", "node", "services", "uptime_ns", "pid", "metrics_port")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    NODE_FIELD_NUMBER: _ClassVar[int]
    SERVICES_FIELD_NUMBER: _ClassVar[int]
    UPTIME_NS_FIELD_NUMBER: _ClassVar[int]
    PID_FIELD_NUMBER: _ClassVar[int]
    METRICS_PORT_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    node: str
    services: _containers.RepeatedScalarFieldContainer[str]
    uptime_ns: int
    pid: int
    metrics_port: int
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., node: _Optional[str] = ..., services: _Optional[_Iterable[str]] = ..., uptime_ns: _Optional[int] = ..., pid: _Optional[int] = ..., metrics_port: _Optional[int] = ...) -> None: ...

class FaultRequest(_message.Message):
    __slots__ = ("name", "target", "seconds", "amount", "by")
    NAME_FIELD_NUMBER: _ClassVar[int]
    TARGET_FIELD_NUMBER: _ClassVar[int]
    SECONDS_FIELD_NUMBER: _ClassVar[int]
    AMOUNT_FIELD_NUMBER: _ClassVar[int]
    BY_FIELD_NUMBER: _ClassVar[int]
    name: str
    target: str
    seconds: float
    amount: float
    by: str
    def __init__(self, name: _Optional[str] = ..., target: _Optional[str] = ..., seconds: _Optional[float] = ..., amount: _Optional[float] = ..., by: _Optional[str] = ...) -> None: ...

class FaultReply(_message.Message):
    __slots__ = ("refused", "struck")
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    STRUCK_FIELD_NUMBER: _ClassVar[int]
    refused: str
    struck: str
    def __init__(self, refused: _Optional[str] = ..., struck: _Optional[str] = ...) -> None: ...

class CertificateRequest(_message.Message):
    __slots__ = ("certificate", "request", "signature")
    CERTIFICATE_FIELD_NUMBER: _ClassVar[int]
    REQUEST_FIELD_NUMBER: _ClassVar[int]
    SIGNATURE_FIELD_NUMBER: _ClassVar[int]
    certificate: bytes
    request: bytes
    signature: bytes
    def __init__(self, certificate: _Optional[bytes] = ..., request: _Optional[bytes] = ..., signature: _Optional[bytes] = ...) -> None: ...

class CertificateReply(_message.Message):
    __slots__ = ("refused", "certificate")
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    CERTIFICATE_FIELD_NUMBER: _ClassVar[int]
    refused: str
    certificate: bytes
    def __init__(self, refused: _Optional[str] = ..., certificate: _Optional[bytes] = ...) -> None: ...

class Revocations(_message.Message):
    __slots__ = ("header", "names")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    NAMES_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    names: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., names: _Optional[_Iterable[str]] = ...) -> None: ...

class Note(_message.Message):
    __slots__ = ("header", "author", "text")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    AUTHOR_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    author: str
    text: str
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., author: _Optional[str] = ..., text: _Optional[str] = ...) -> None: ...

class HostAction(_message.Message):
    __slots__ = ("header", "who", "action", "text", "done", "answer")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    WHO_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    DONE_FIELD_NUMBER: _ClassVar[int]
    ANSWER_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    who: str
    action: str
    text: str
    done: bool
    answer: str
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., who: _Optional[str] = ..., action: _Optional[str] = ..., text: _Optional[str] = ..., done: _Optional[bool] = ..., answer: _Optional[str] = ...) -> None: ...

class RunRequest(_message.Message):
    __slots__ = ("action", "process", "by")
    class Action(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        ACTION_UNSPECIFIED: _ClassVar[RunRequest.Action]
        ACTION_START: _ClassVar[RunRequest.Action]
        ACTION_STOP: _ClassVar[RunRequest.Action]
        ACTION_RESTART: _ClassVar[RunRequest.Action]
    ACTION_UNSPECIFIED: RunRequest.Action
    ACTION_START: RunRequest.Action
    ACTION_STOP: RunRequest.Action
    ACTION_RESTART: RunRequest.Action
    ACTION_FIELD_NUMBER: _ClassVar[int]
    PROCESS_FIELD_NUMBER: _ClassVar[int]
    BY_FIELD_NUMBER: _ClassVar[int]
    action: RunRequest.Action
    process: str
    by: str
    def __init__(self, action: _Optional[_Union[RunRequest.Action, str]] = ..., process: _Optional[str] = ..., by: _Optional[str] = ...) -> None: ...

class RunReply(_message.Message):
    __slots__ = ("refused", "done", "processes", "faults")
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    DONE_FIELD_NUMBER: _ClassVar[int]
    PROCESSES_FIELD_NUMBER: _ClassVar[int]
    FAULTS_FIELD_NUMBER: _ClassVar[int]
    refused: str
    done: str
    processes: _containers.RepeatedCompositeFieldContainer[RunProcess]
    faults: _containers.RepeatedCompositeFieldContainer[RunFault]
    def __init__(self, refused: _Optional[str] = ..., done: _Optional[str] = ..., processes: _Optional[_Iterable[_Union[RunProcess, _Mapping]]] = ..., faults: _Optional[_Iterable[_Union[RunFault, _Mapping]]] = ...) -> None: ...

class RunProcess(_message.Message):
    __slots__ = ("name", "state", "restarts")
    class State(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        STATE_UNSPECIFIED: _ClassVar[RunProcess.State]
        STATE_RUNNING: _ClassVar[RunProcess.State]
        STATE_STARTING: _ClassVar[RunProcess.State]
        STATE_STOPPED: _ClassVar[RunProcess.State]
        STATE_ENDING: _ClassVar[RunProcess.State]
    STATE_UNSPECIFIED: RunProcess.State
    STATE_RUNNING: RunProcess.State
    STATE_STARTING: RunProcess.State
    STATE_STOPPED: RunProcess.State
    STATE_ENDING: RunProcess.State
    NAME_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    RESTARTS_FIELD_NUMBER: _ClassVar[int]
    name: str
    state: RunProcess.State
    restarts: int
    def __init__(self, name: _Optional[str] = ..., state: _Optional[_Union[RunProcess.State, str]] = ..., restarts: _Optional[int] = ...) -> None: ...

class RunFault(_message.Message):
    __slots__ = ("name", "about", "seconds", "amount", "unit", "targets")
    NAME_FIELD_NUMBER: _ClassVar[int]
    ABOUT_FIELD_NUMBER: _ClassVar[int]
    SECONDS_FIELD_NUMBER: _ClassVar[int]
    AMOUNT_FIELD_NUMBER: _ClassVar[int]
    UNIT_FIELD_NUMBER: _ClassVar[int]
    TARGETS_FIELD_NUMBER: _ClassVar[int]
    name: str
    about: str
    seconds: float
    amount: float
    unit: str
    targets: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, name: _Optional[str] = ..., about: _Optional[str] = ..., seconds: _Optional[float] = ..., amount: _Optional[float] = ..., unit: _Optional[str] = ..., targets: _Optional[_Iterable[str]] = ...) -> None: ...
