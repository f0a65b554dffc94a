from vistel.v1 import envelope_pb2 as _envelope_pb2
from vistel.v1 import geometry_pb2 as _geometry_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Towards(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    TOWARDS_UNSPECIFIED: _ClassVar[Towards]
    TOWARDS_RIGHT: _ClassVar[Towards]
    TOWARDS_LEFT: _ClassVar[Towards]
    TOWARDS_UP: _ClassVar[Towards]
    TOWARDS_DOWN: _ClassVar[Towards]
    TOWARDS_AHEAD: _ClassVar[Towards]
    TOWARDS_BACK: _ClassVar[Towards]

class Along(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    ALONG_UNSPECIFIED: _ClassVar[Along]
    ALONG_LONGEST: _ClassVar[Along]
    ALONG_UP: _ClassVar[Along]
    ALONG_ACROSS: _ClassVar[Along]
    ALONG_AHEAD: _ClassVar[Along]
    ALONG_GIRTH: _ClassVar[Along]

class Where(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    WHERE_UNSPECIFIED: _ClassVar[Where]
    WHERE_HERE: _ClassVar[Where]
    WHERE_POINTED: _ClassVar[Where]

class Reaction(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    REACTION_UNSPECIFIED: _ClassVar[Reaction]
    REACTION_THUMB_UP: _ClassVar[Reaction]
    REACTION_CLAP: _ClassVar[Reaction]
    REACTION_HEART: _ClassVar[Reaction]
    REACTION_LAUGH: _ClassVar[Reaction]
    REACTION_SURPRISE: _ClassVar[Reaction]
TOWARDS_UNSPECIFIED: Towards
TOWARDS_RIGHT: Towards
TOWARDS_LEFT: Towards
TOWARDS_UP: Towards
TOWARDS_DOWN: Towards
TOWARDS_AHEAD: Towards
TOWARDS_BACK: Towards
ALONG_UNSPECIFIED: Along
ALONG_LONGEST: Along
ALONG_UP: Along
ALONG_ACROSS: Along
ALONG_AHEAD: Along
ALONG_GIRTH: Along
WHERE_UNSPECIFIED: Where
WHERE_HERE: Where
WHERE_POINTED: Where
REACTION_UNSPECIFIED: Reaction
REACTION_THUMB_UP: Reaction
REACTION_CLAP: Reaction
REACTION_HEART: Reaction
REACTION_LAUGH: Reaction
REACTION_SURPRISE: Reaction

class Command(_message.Message):
    __slots__ = ("header", "id", "participant", "move", "release", "delete", "reset", "select", "move_by", "place", "turn", "scale", "bend", "twist", "paint", "harden", "copy", "create", "grip", "attach", "detach", "undo", "redo", "stop", "hide", "show", "align", "dent", "sharpen", "present", "turn_page", "put_away", "open", "put_up_board", "draw", "rub", "wipe", "raise_hand", "react", "write_note")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    MOVE_FIELD_NUMBER: _ClassVar[int]
    RELEASE_FIELD_NUMBER: _ClassVar[int]
    DELETE_FIELD_NUMBER: _ClassVar[int]
    RESET_FIELD_NUMBER: _ClassVar[int]
    SELECT_FIELD_NUMBER: _ClassVar[int]
    MOVE_BY_FIELD_NUMBER: _ClassVar[int]
    PLACE_FIELD_NUMBER: _ClassVar[int]
    TURN_FIELD_NUMBER: _ClassVar[int]
    SCALE_FIELD_NUMBER: _ClassVar[int]
    BEND_FIELD_NUMBER: _ClassVar[int]
    TWIST_FIELD_NUMBER: _ClassVar[int]
    PAINT_FIELD_NUMBER: _ClassVar[int]
    HARDEN_FIELD_NUMBER: _ClassVar[int]
    COPY_FIELD_NUMBER: _ClassVar[int]
    CREATE_FIELD_NUMBER: _ClassVar[int]
    GRIP_FIELD_NUMBER: _ClassVar[int]
    ATTACH_FIELD_NUMBER: _ClassVar[int]
    DETACH_FIELD_NUMBER: _ClassVar[int]
    UNDO_FIELD_NUMBER: _ClassVar[int]
    REDO_FIELD_NUMBER: _ClassVar[int]
    STOP_FIELD_NUMBER: _ClassVar[int]
    HIDE_FIELD_NUMBER: _ClassVar[int]
    SHOW_FIELD_NUMBER: _ClassVar[int]
    ALIGN_FIELD_NUMBER: _ClassVar[int]
    DENT_FIELD_NUMBER: _ClassVar[int]
    SHARPEN_FIELD_NUMBER: _ClassVar[int]
    PRESENT_FIELD_NUMBER: _ClassVar[int]
    TURN_PAGE_FIELD_NUMBER: _ClassVar[int]
    PUT_AWAY_FIELD_NUMBER: _ClassVar[int]
    OPEN_FIELD_NUMBER: _ClassVar[int]
    PUT_UP_BOARD_FIELD_NUMBER: _ClassVar[int]
    DRAW_FIELD_NUMBER: _ClassVar[int]
    RUB_FIELD_NUMBER: _ClassVar[int]
    WIPE_FIELD_NUMBER: _ClassVar[int]
    RAISE_HAND_FIELD_NUMBER: _ClassVar[int]
    REACT_FIELD_NUMBER: _ClassVar[int]
    WRITE_NOTE_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    id: str
    participant: str
    move: MoveThing
    release: ReleaseThing
    delete: DeleteThing
    reset: ResetRoom
    select: SelectThings
    move_by: MoveThingBy
    place: PlaceThing
    turn: TurnThing
    scale: ScaleThing
    bend: BendThing
    twist: TwistThing
    paint: PaintThing
    harden: HardenThing
    copy: CopyThing
    create: CreateThing
    grip: GripThing
    attach: AttachThing
    detach: DetachThing
    undo: UndoLast
    redo: RedoLast
    stop: StopMoving
    hide: HideThing
    show: ShowThing
    align: AlignThings
    dent: DentThing
    sharpen: SharpenThing
    present: PresentPages
    turn_page: TurnPage
    put_away: PutAway
    open: OpenThing
    put_up_board: PutUpBoard
    draw: DrawStroke
    rub: RubOut
    wipe: WipeBoard
    raise_hand: RaiseHand
    react: ReactTo
    write_note: WriteNote
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., id: _Optional[str] = ..., participant: _Optional[str] = ..., move: _Optional[_Union[MoveThing, _Mapping]] = ..., release: _Optional[_Union[ReleaseThing, _Mapping]] = ..., delete: _Optional[_Union[DeleteThing, _Mapping]] = ..., reset: _Optional[_Union[ResetRoom, _Mapping]] = ..., select: _Optional[_Union[SelectThings, _Mapping]] = ..., move_by: _Optional[_Union[MoveThingBy, _Mapping]] = ..., place: _Optional[_Union[PlaceThing, _Mapping]] = ..., turn: _Optional[_Union[TurnThing, _Mapping]] = ..., scale: _Optional[_Union[ScaleThing, _Mapping]] = ..., bend: _Optional[_Union[BendThing, _Mapping]] = ..., twist: _Optional[_Union[TwistThing, _Mapping]] = ..., paint: _Optional[_Union[PaintThing, _Mapping]] = ..., harden: _Optional[_Union[HardenThing, _Mapping]] = ..., copy: _Optional[_Union[CopyThing, _Mapping]] = ..., create: _Optional[_Union[CreateThing, _Mapping]] = ..., grip: _Optional[_Union[GripThing, _Mapping]] = ..., attach: _Optional[_Union[AttachThing, _Mapping]] = ..., detach: _Optional[_Union[DetachThing, _Mapping]] = ..., undo: _Optional[_Union[UndoLast, _Mapping]] = ..., redo: _Optional[_Union[RedoLast, _Mapping]] = ..., stop: _Optional[_Union[StopMoving, _Mapping]] = ..., hide: _Optional[_Union[HideThing, _Mapping]] = ..., show: _Optional[_Union[ShowThing, _Mapping]] = ..., align: _Optional[_Union[AlignThings, _Mapping]] = ..., dent: _Optional[_Union[DentThing, _Mapping]] = ..., sharpen: _Optional[_Union[SharpenThing, _Mapping]] = ..., present: _Optional[_Union[PresentPages, _Mapping]] = ..., turn_page: _Optional[_Union[TurnPage, _Mapping]] = ..., put_away: _Optional[_Union[PutAway, _Mapping]] = ..., open: _Optional[_Union[OpenThing, _Mapping]] = ..., put_up_board: _Optional[_Union[PutUpBoard, _Mapping]] = ..., draw: _Optional[_Union[DrawStroke, _Mapping]] = ..., rub: _Optional[_Union[RubOut, _Mapping]] = ..., wipe: _Optional[_Union[WipeBoard, _Mapping]] = ..., raise_hand: _Optional[_Union[RaiseHand, _Mapping]] = ..., react: _Optional[_Union[ReactTo, _Mapping]] = ..., write_note: _Optional[_Union[WriteNote, _Mapping]] = ...) -> None: ...

class Which(_message.Message):
    __slots__ = ("thing", "name", "shape", "colour", "shown", "every", "size")
    class Shown(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        SHOWN_UNSPECIFIED: _ClassVar[Which.Shown]
        SHOWN_POINTED: _ClassVar[Which.Shown]
        SHOWN_LOOKED_AT: _ClassVar[Which.Shown]
        SHOWN_SELECTED: _ClassVar[Which.Shown]
        SHOWN_HELD: _ClassVar[Which.Shown]
    SHOWN_UNSPECIFIED: Which.Shown
    SHOWN_POINTED: Which.Shown
    SHOWN_LOOKED_AT: Which.Shown
    SHOWN_SELECTED: Which.Shown
    SHOWN_HELD: Which.Shown
    class Size(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        SIZE_UNSPECIFIED: _ClassVar[Which.Size]
        SIZE_LARGEST: _ClassVar[Which.Size]
        SIZE_SMALLEST: _ClassVar[Which.Size]
    SIZE_UNSPECIFIED: Which.Size
    SIZE_LARGEST: Which.Size
    SIZE_SMALLEST: Which.Size
    THING_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    SHAPE_FIELD_NUMBER: _ClassVar[int]
    COLOUR_FIELD_NUMBER: _ClassVar[int]
    SHOWN_FIELD_NUMBER: _ClassVar[int]
    EVERY_FIELD_NUMBER: _ClassVar[int]
    SIZE_FIELD_NUMBER: _ClassVar[int]
    thing: str
    name: str
    shape: str
    colour: str
    shown: Which.Shown
    every: bool
    size: Which.Size
    def __init__(self, thing: _Optional[str] = ..., name: _Optional[str] = ..., shape: _Optional[str] = ..., colour: _Optional[str] = ..., shown: _Optional[_Union[Which.Shown, str]] = ..., every: _Optional[bool] = ..., size: _Optional[_Union[Which.Size, str]] = ...) -> None: ...

class MoveThing(_message.Message):
    __slots__ = ("thing", "pose", "which")
    THING_FIELD_NUMBER: _ClassVar[int]
    POSE_FIELD_NUMBER: _ClassVar[int]
    WHICH_FIELD_NUMBER: _ClassVar[int]
    thing: str
    pose: _geometry_pb2.Pose
    which: Which
    def __init__(self, thing: _Optional[str] = ..., pose: _Optional[_Union[_geometry_pb2.Pose, _Mapping]] = ..., which: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class ReleaseThing(_message.Message):
    __slots__ = ("thing", "which")
    THING_FIELD_NUMBER: _ClassVar[int]
    WHICH_FIELD_NUMBER: _ClassVar[int]
    thing: str
    which: Which
    def __init__(self, thing: _Optional[str] = ..., which: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class DeleteThing(_message.Message):
    __slots__ = ("thing", "which")
    THING_FIELD_NUMBER: _ClassVar[int]
    WHICH_FIELD_NUMBER: _ClassVar[int]
    thing: str
    which: Which
    def __init__(self, thing: _Optional[str] = ..., which: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class ResetRoom(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class SelectThings(_message.Message):
    __slots__ = ("which", "nothing")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    NOTHING_FIELD_NUMBER: _ClassVar[int]
    which: Which
    nothing: bool
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., nothing: _Optional[bool] = ...) -> None: ...

class MoveThingBy(_message.Message):
    __slots__ = ("which", "towards", "distance")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    TOWARDS_FIELD_NUMBER: _ClassVar[int]
    DISTANCE_FIELD_NUMBER: _ClassVar[int]
    which: Which
    towards: Towards
    distance: float
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., towards: _Optional[_Union[Towards, str]] = ..., distance: _Optional[float] = ...) -> None: ...

class PlaceThing(_message.Message):
    __slots__ = ("which", "where")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    WHERE_FIELD_NUMBER: _ClassVar[int]
    which: Which
    where: Where
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., where: _Optional[_Union[Where, str]] = ...) -> None: ...

class TurnThing(_message.Message):
    __slots__ = ("which", "angle", "about")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    ANGLE_FIELD_NUMBER: _ClassVar[int]
    ABOUT_FIELD_NUMBER: _ClassVar[int]
    which: Which
    angle: float
    about: Along
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., angle: _Optional[float] = ..., about: _Optional[_Union[Along, str]] = ...) -> None: ...

class ScaleThing(_message.Message):
    __slots__ = ("which", "factor", "along")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    FACTOR_FIELD_NUMBER: _ClassVar[int]
    ALONG_FIELD_NUMBER: _ClassVar[int]
    which: Which
    factor: float
    along: Along
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., factor: _Optional[float] = ..., along: _Optional[_Union[Along, str]] = ...) -> None: ...

class BendThing(_message.Message):
    __slots__ = ("which", "angle")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    ANGLE_FIELD_NUMBER: _ClassVar[int]
    which: Which
    angle: float
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., angle: _Optional[float] = ...) -> None: ...

class TwistThing(_message.Message):
    __slots__ = ("which", "angle")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    ANGLE_FIELD_NUMBER: _ClassVar[int]
    which: Which
    angle: float
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., angle: _Optional[float] = ...) -> None: ...

class PaintThing(_message.Message):
    __slots__ = ("which", "colour")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    COLOUR_FIELD_NUMBER: _ClassVar[int]
    which: Which
    colour: int
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., colour: _Optional[int] = ...) -> None: ...

class HardenThing(_message.Message):
    __slots__ = ("which", "rigidity")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    RIGIDITY_FIELD_NUMBER: _ClassVar[int]
    which: Which
    rigidity: float
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., rigidity: _Optional[float] = ...) -> None: ...

class CopyThing(_message.Message):
    __slots__ = ("which",)
    WHICH_FIELD_NUMBER: _ClassVar[int]
    which: Which
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class CreateThing(_message.Message):
    __slots__ = ("shape", "size", "colour", "where")
    SHAPE_FIELD_NUMBER: _ClassVar[int]
    SIZE_FIELD_NUMBER: _ClassVar[int]
    COLOUR_FIELD_NUMBER: _ClassVar[int]
    WHERE_FIELD_NUMBER: _ClassVar[int]
    shape: str
    size: float
    colour: int
    where: Where
    def __init__(self, shape: _Optional[str] = ..., size: _Optional[float] = ..., colour: _Optional[int] = ..., where: _Optional[_Union[Where, str]] = ...) -> None: ...

class GripThing(_message.Message):
    __slots__ = ("which", "force")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    FORCE_FIELD_NUMBER: _ClassVar[int]
    which: Which
    force: bool
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., force: _Optional[bool] = ...) -> None: ...

class AttachThing(_message.Message):
    __slots__ = ("which", "to")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    TO_FIELD_NUMBER: _ClassVar[int]
    which: Which
    to: Which
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., to: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class DetachThing(_message.Message):
    __slots__ = ("which",)
    WHICH_FIELD_NUMBER: _ClassVar[int]
    which: Which
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class UndoLast(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class RedoLast(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class StopMoving(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class HideThing(_message.Message):
    __slots__ = ("which",)
    WHICH_FIELD_NUMBER: _ClassVar[int]
    which: Which
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class ShowThing(_message.Message):
    __slots__ = ("which",)
    WHICH_FIELD_NUMBER: _ClassVar[int]
    which: Which
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class AlignThings(_message.Message):
    __slots__ = ("which",)
    WHICH_FIELD_NUMBER: _ClassVar[int]
    which: Which
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class DentThing(_message.Message):
    __slots__ = ("which", "depth")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    DEPTH_FIELD_NUMBER: _ClassVar[int]
    which: Which
    depth: float
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., depth: _Optional[float] = ...) -> None: ...

class SharpenThing(_message.Message):
    __slots__ = ("which", "by")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    BY_FIELD_NUMBER: _ClassVar[int]
    which: Which
    by: float
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., by: _Optional[float] = ...) -> None: ...

class PresentPages(_message.Message):
    __slots__ = ("pages", "aspect", "title", "live")
    PAGES_FIELD_NUMBER: _ClassVar[int]
    ASPECT_FIELD_NUMBER: _ClassVar[int]
    TITLE_FIELD_NUMBER: _ClassVar[int]
    LIVE_FIELD_NUMBER: _ClassVar[int]
    pages: _containers.RepeatedScalarFieldContainer[str]
    aspect: float
    title: str
    live: bool
    def __init__(self, pages: _Optional[_Iterable[str]] = ..., aspect: _Optional[float] = ..., title: _Optional[str] = ..., live: _Optional[bool] = ...) -> None: ...

class TurnPage(_message.Message):
    __slots__ = ("which", "by", "page")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    BY_FIELD_NUMBER: _ClassVar[int]
    PAGE_FIELD_NUMBER: _ClassVar[int]
    which: Which
    by: float
    page: float
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., by: _Optional[float] = ..., page: _Optional[float] = ...) -> None: ...

class PutAway(_message.Message):
    __slots__ = ("which",)
    WHICH_FIELD_NUMBER: _ClassVar[int]
    which: Which
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class OpenThing(_message.Message):
    __slots__ = ("which", "share")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    SHARE_FIELD_NUMBER: _ClassVar[int]
    which: Which
    share: float
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., share: _Optional[float] = ...) -> None: ...

class PutUpBoard(_message.Message):
    __slots__ = ("title",)
    TITLE_FIELD_NUMBER: _ClassVar[int]
    title: str
    def __init__(self, title: _Optional[str] = ...) -> None: ...

class WriteNote(_message.Message):
    __slots__ = ("text",)
    TEXT_FIELD_NUMBER: _ClassVar[int]
    text: str
    def __init__(self, text: _Optional[str] = ...) -> None: ...

class DrawStroke(_message.Message):
    __slots__ = ("which", "points", "colour", "width", "stroke")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    POINTS_FIELD_NUMBER: _ClassVar[int]
    COLOUR_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    STROKE_FIELD_NUMBER: _ClassVar[int]
    which: Which
    points: _containers.RepeatedScalarFieldContainer[int]
    colour: int
    width: int
    stroke: str
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., points: _Optional[_Iterable[int]] = ..., colour: _Optional[int] = ..., width: _Optional[int] = ..., stroke: _Optional[str] = ...) -> None: ...

class RubOut(_message.Message):
    __slots__ = ("which", "points", "width")
    WHICH_FIELD_NUMBER: _ClassVar[int]
    POINTS_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    which: Which
    points: _containers.RepeatedScalarFieldContainer[int]
    width: int
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ..., points: _Optional[_Iterable[int]] = ..., width: _Optional[int] = ...) -> None: ...

class WipeBoard(_message.Message):
    __slots__ = ("which",)
    WHICH_FIELD_NUMBER: _ClassVar[int]
    which: Which
    def __init__(self, which: _Optional[_Union[Which, _Mapping]] = ...) -> None: ...

class RaiseHand(_message.Message):
    __slots__ = ("down",)
    DOWN_FIELD_NUMBER: _ClassVar[int]
    down: bool
    def __init__(self, down: _Optional[bool] = ...) -> None: ...

class ReactTo(_message.Message):
    __slots__ = ("reaction",)
    REACTION_FIELD_NUMBER: _ClassVar[int]
    reaction: Reaction
    def __init__(self, reaction: _Optional[_Union[Reaction, str]] = ...) -> None: ...

class CommandResult(_message.Message):
    __slots__ = ("header", "id", "outcome", "reason", "step", "things")
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
    THINGS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    id: str
    outcome: CommandResult.Outcome
    reason: str
    step: int
    things: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., id: _Optional[str] = ..., outcome: _Optional[_Union[CommandResult.Outcome, str]] = ..., reason: _Optional[str] = ..., step: _Optional[int] = ..., things: _Optional[_Iterable[str]] = ...) -> None: ...
