from vistel.v1 import envelope_pb2 as _envelope_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Utterance(_message.Message):
    __slots__ = ("header", "id", "participant", "language", "text", "confidence", "start_ns", "end_ns", "state", "reply", "command", "things", "readings", "spoken")
    class State(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        STATE_UNSPECIFIED: _ClassVar[Utterance.State]
        STATE_REJECTED: _ClassVar[Utterance.State]
        STATE_SENT: _ClassVar[Utterance.State]
        STATE_DONE: _ClassVar[Utterance.State]
        STATE_REFUSED: _ClassVar[Utterance.State]
        STATE_QUESTION: _ClassVar[Utterance.State]
        STATE_NOTED: _ClassVar[Utterance.State]
    STATE_UNSPECIFIED: Utterance.State
    STATE_REJECTED: Utterance.State
    STATE_SENT: Utterance.State
    STATE_DONE: Utterance.State
    STATE_REFUSED: Utterance.State
    STATE_QUESTION: Utterance.State
    STATE_NOTED: Utterance.State
    class Reading(_message.Message):
        __slots__ = ("text", "confidence")
        TEXT_FIELD_NUMBER: _ClassVar[int]
        CONFIDENCE_FIELD_NUMBER: _ClassVar[int]
        text: str
        confidence: float
        def __init__(self, text: _Optional[str] = ..., confidence: _Optional[float] = ...) -> None: ...
    HEADER_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    LANGUAGE_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    CONFIDENCE_FIELD_NUMBER: _ClassVar[int]
    START_NS_FIELD_NUMBER: _ClassVar[int]
    END_NS_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    REPLY_FIELD_NUMBER: _ClassVar[int]
    COMMAND_FIELD_NUMBER: _ClassVar[int]
    THINGS_FIELD_NUMBER: _ClassVar[int]
    READINGS_FIELD_NUMBER: _ClassVar[int]
    SPOKEN_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    id: str
    participant: str
    language: str
    text: str
    confidence: float
    start_ns: int
    end_ns: int
    state: Utterance.State
    reply: str
    command: str
    things: _containers.RepeatedScalarFieldContainer[str]
    readings: _containers.RepeatedCompositeFieldContainer[Utterance.Reading]
    spoken: str
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., id: _Optional[str] = ..., participant: _Optional[str] = ..., language: _Optional[str] = ..., text: _Optional[str] = ..., confidence: _Optional[float] = ..., start_ns: _Optional[int] = ..., end_ns: _Optional[int] = ..., state: _Optional[_Union[Utterance.State, str]] = ..., reply: _Optional[str] = ..., command: _Optional[str] = ..., things: _Optional[_Iterable[str]] = ..., readings: _Optional[_Iterable[_Union[Utterance.Reading, _Mapping]]] = ..., spoken: _Optional[str] = ...) -> None: ...

class ChatLine(_message.Message):
    __slots__ = ("header", "id", "text")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    id: str
    text: str
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., id: _Optional[str] = ..., text: _Optional[str] = ...) -> None: ...
