from vistel.v1 import envelope_pb2 as _envelope_pb2
from vistel.v1 import geometry_pb2 as _geometry_pb2
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Command(_message.Message):
    __slots__ = ("header", "id", "participant", "move", "release", "delete", "reset")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    MOVE_FIELD_NUMBER: _ClassVar[int]
    RELEASE_FIELD_NUMBER: _ClassVar[int]
    DELETE_FIELD_NUMBER: _ClassVar[int]
    RESET_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    id: str
    participant: str
    move: MoveThing
    release: ReleaseThing
    delete: DeleteThing
    reset: ResetRoom
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., id: _Optional[str] = ..., participant: _Optional[str] = ..., move: _Optional[_Union[MoveThing, _Mapping]] = ..., release: _Optional[_Union[ReleaseThing, _Mapping]] = ..., delete: _Optional[_Union[DeleteThing, _Mapping]] = ..., reset: _Optional[_Union[ResetRoom, _Mapping]] = ...) -> None: ...

class MoveThing(_message.Message):
    __slots__ = ("thing", "pose")
    THING_FIELD_NUMBER: _ClassVar[int]
    POSE_FIELD_NUMBER: _ClassVar[int]
    thing: str
    pose: _geometry_pb2.Pose
    def __init__(self, thing: _Optional[str] = ..., pose: _Optional[_Union[_geometry_pb2.Pose, _Mapping]] = ...) -> None: ...

class ReleaseThing(_message.Message):
    __slots__ = ("thing",)
    THING_FIELD_NUMBER: _ClassVar[int]
    thing: str
    def __init__(self, thing: _Optional[str] = ...) -> None: ...

class DeleteThing(_message.Message):
    __slots__ = ("thing",)
    THING_FIELD_NUMBER: _ClassVar[int]
    thing: str
    def __init__(self, thing: _Optional[str] = ...) -> None: ...

class ResetRoom(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class CommandResult(_message.Message):
    __slots__ = ("header", "id", "outcome", "reason", "step")
    class Outcome(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        OUTCOME_UNSPECIFIED: _ClassVar[CommandResult.Outcome]
        OUTCOME_DONE: _ClassVar[CommandResult.Outcome]
        OUTCOME_REFUSED: _ClassVar[CommandResult.Outcome]
    OUTCOME_UNSPECIFIED: CommandResult.Outcome
    OUTCOME_DONE: CommandResult.Outcome
    OUTCOME_REFUSED: CommandResult.Outcome
    HEADER_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    OUTCOME_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    id: str
    outcome: CommandResult.Outcome
    reason: str
    step: int
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., id: _Optional[str] = ..., outcome: _Optional[_Union[CommandResult.Outcome, str]] = ..., reason: _Optional[str] = ..., step: _Optional[int] = ...) -> None: ...
