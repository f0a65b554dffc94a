from vistel.v1 import command_pb2 as _command_pb2
from vistel.v1 import envelope_pb2 as _envelope_pb2
from vistel.v1 import geometry_pb2 as _geometry_pb2
from vistel.v1 import motion_pb2 as _motion_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Primitive(_message.Message):
    __slots__ = ("kind", "params", "pose", "colour")
    KIND_FIELD_NUMBER: _ClassVar[int]
    PARAMS_FIELD_NUMBER: _ClassVar[int]
    POSE_FIELD_NUMBER: _ClassVar[int]
    COLOUR_FIELD_NUMBER: _ClassVar[int]
    kind: str
    params: _containers.RepeatedScalarFieldContainer[float]
    pose: _geometry_pb2.Pose
    colour: int
    def __init__(self, kind: _Optional[str] = ..., params: _Optional[_Iterable[float]] = ..., pose: _Optional[_Union[_geometry_pb2.Pose, _Mapping]] = ..., colour: _Optional[int] = ...) -> None: ...

class Curve(_message.Message):
    __slots__ = ("straight", "along", "side", "low", "high", "bend", "twist", "centre")
    STRAIGHT_FIELD_NUMBER: _ClassVar[int]
    ALONG_FIELD_NUMBER: _ClassVar[int]
    SIDE_FIELD_NUMBER: _ClassVar[int]
    LOW_FIELD_NUMBER: _ClassVar[int]
    HIGH_FIELD_NUMBER: _ClassVar[int]
    BEND_FIELD_NUMBER: _ClassVar[int]
    TWIST_FIELD_NUMBER: _ClassVar[int]
    CENTRE_FIELD_NUMBER: _ClassVar[int]
    straight: _containers.RepeatedCompositeFieldContainer[Primitive]
    along: _geometry_pb2.Vec3
    side: _geometry_pb2.Vec3
    low: float
    high: float
    bend: float
    twist: float
    centre: _geometry_pb2.Vec3
    def __init__(self, straight: _Optional[_Iterable[_Union[Primitive, _Mapping]]] = ..., along: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., side: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., low: _Optional[float] = ..., high: _Optional[float] = ..., bend: _Optional[float] = ..., twist: _Optional[float] = ..., centre: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ...) -> None: ...

class Look(_message.Message):
    __slots__ = ("model", "matrix", "offset", "colour")
    MODEL_FIELD_NUMBER: _ClassVar[int]
    MATRIX_FIELD_NUMBER: _ClassVar[int]
    OFFSET_FIELD_NUMBER: _ClassVar[int]
    COLOUR_FIELD_NUMBER: _ClassVar[int]
    model: str
    matrix: _containers.RepeatedScalarFieldContainer[float]
    offset: _geometry_pb2.Vec3
    colour: int
    def __init__(self, model: _Optional[str] = ..., matrix: _Optional[_Iterable[float]] = ..., offset: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., colour: _Optional[int] = ...) -> None: ...

class Pages(_message.Message):
    __slots__ = ("models", "shown", "by", "live")
    MODELS_FIELD_NUMBER: _ClassVar[int]
    SHOWN_FIELD_NUMBER: _ClassVar[int]
    BY_FIELD_NUMBER: _ClassVar[int]
    LIVE_FIELD_NUMBER: _ClassVar[int]
    models: _containers.RepeatedScalarFieldContainer[str]
    shown: int
    by: str
    live: bool
    def __init__(self, models: _Optional[_Iterable[str]] = ..., shown: _Optional[int] = ..., by: _Optional[str] = ..., live: _Optional[bool] = ...) -> None: ...

class Thing(_message.Message):
    __slots__ = ("id", "name", "primitives", "mass_kg", "compliance", "colour", "texture", "shape", "material", "sticky", "bears", "curve", "looks", "hidden", "pages")
    ID_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    PRIMITIVES_FIELD_NUMBER: _ClassVar[int]
    MASS_KG_FIELD_NUMBER: _ClassVar[int]
    COMPLIANCE_FIELD_NUMBER: _ClassVar[int]
    COLOUR_FIELD_NUMBER: _ClassVar[int]
    TEXTURE_FIELD_NUMBER: _ClassVar[int]
    SHAPE_FIELD_NUMBER: _ClassVar[int]
    MATERIAL_FIELD_NUMBER: _ClassVar[int]
    STICKY_FIELD_NUMBER: _ClassVar[int]
    BEARS_FIELD_NUMBER: _ClassVar[int]
    CURVE_FIELD_NUMBER: _ClassVar[int]
    LOOKS_FIELD_NUMBER: _ClassVar[int]
    HIDDEN_FIELD_NUMBER: _ClassVar[int]
    PAGES_FIELD_NUMBER: _ClassVar[int]
    id: str
    name: str
    primitives: _containers.RepeatedCompositeFieldContainer[Primitive]
    mass_kg: float
    compliance: float
    colour: int
    texture: str
    shape: str
    material: str
    sticky: float
    bears: float
    curve: Curve
    looks: _containers.RepeatedCompositeFieldContainer[Look]
    hidden: bool
    pages: Pages
    def __init__(self, id: _Optional[str] = ..., name: _Optional[str] = ..., primitives: _Optional[_Iterable[_Union[Primitive, _Mapping]]] = ..., mass_kg: _Optional[float] = ..., compliance: _Optional[float] = ..., colour: _Optional[int] = ..., texture: _Optional[str] = ..., shape: _Optional[str] = ..., material: _Optional[str] = ..., sticky: _Optional[float] = ..., bears: _Optional[float] = ..., curve: _Optional[_Union[Curve, _Mapping]] = ..., looks: _Optional[_Iterable[_Union[Look, _Mapping]]] = ..., hidden: _Optional[bool] = ..., pages: _Optional[_Union[Pages, _Mapping]] = ...) -> None: ...

class Dent(_message.Message):
    __slots__ = ("number", "thing", "shape", "depth", "left_ns", "fade_s")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    THING_FIELD_NUMBER: _ClassVar[int]
    SHAPE_FIELD_NUMBER: _ClassVar[int]
    DEPTH_FIELD_NUMBER: _ClassVar[int]
    LEFT_NS_FIELD_NUMBER: _ClassVar[int]
    FADE_S_FIELD_NUMBER: _ClassVar[int]
    number: int
    thing: str
    shape: Primitive
    depth: float
    left_ns: int
    fade_s: float
    def __init__(self, number: _Optional[int] = ..., thing: _Optional[str] = ..., shape: _Optional[_Union[Primitive, _Mapping]] = ..., depth: _Optional[float] = ..., left_ns: _Optional[int] = ..., fade_s: _Optional[float] = ...) -> None: ...

class Bond(_message.Message):
    __slots__ = ("number", "thing", "body", "primitive", "point_thing", "point_body", "reach", "torn_ns")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    THING_FIELD_NUMBER: _ClassVar[int]
    BODY_FIELD_NUMBER: _ClassVar[int]
    PRIMITIVE_FIELD_NUMBER: _ClassVar[int]
    POINT_THING_FIELD_NUMBER: _ClassVar[int]
    POINT_BODY_FIELD_NUMBER: _ClassVar[int]
    REACH_FIELD_NUMBER: _ClassVar[int]
    TORN_NS_FIELD_NUMBER: _ClassVar[int]
    number: int
    thing: str
    body: str
    primitive: int
    point_thing: _geometry_pb2.Vec3
    point_body: _geometry_pb2.Vec3
    reach: float
    torn_ns: int
    def __init__(self, number: _Optional[int] = ..., thing: _Optional[str] = ..., body: _Optional[str] = ..., primitive: _Optional[int] = ..., point_thing: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., point_body: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., reach: _Optional[float] = ..., torn_ns: _Optional[int] = ...) -> None: ...

class Stroke(_message.Message):
    __slots__ = ("number", "board", "by", "id", "colour", "width", "ink")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    BOARD_FIELD_NUMBER: _ClassVar[int]
    BY_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    COLOUR_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    INK_FIELD_NUMBER: _ClassVar[int]
    number: int
    board: str
    by: str
    id: str
    colour: int
    width: int
    ink: bytes
    def __init__(self, number: _Optional[int] = ..., board: _Optional[str] = ..., by: _Optional[str] = ..., id: _Optional[str] = ..., colour: _Optional[int] = ..., width: _Optional[int] = ..., ink: _Optional[bytes] = ...) -> None: ...

class BondTorn(_message.Message):
    __slots__ = ("header", "step", "number", "thing", "body", "primitive", "point", "force", "gap")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    THING_FIELD_NUMBER: _ClassVar[int]
    BODY_FIELD_NUMBER: _ClassVar[int]
    PRIMITIVE_FIELD_NUMBER: _ClassVar[int]
    POINT_FIELD_NUMBER: _ClassVar[int]
    FORCE_FIELD_NUMBER: _ClassVar[int]
    GAP_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    step: int
    number: int
    thing: str
    body: str
    primitive: int
    point: _geometry_pb2.Vec3
    force: float
    gap: float
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., step: _Optional[int] = ..., number: _Optional[int] = ..., thing: _Optional[str] = ..., body: _Optional[str] = ..., primitive: _Optional[int] = ..., point: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., force: _Optional[float] = ..., gap: _Optional[float] = ...) -> None: ...

class ThingState(_message.Message):
    __slots__ = ("id", "pose", "velocity", "spin", "holders", "resting")
    ID_FIELD_NUMBER: _ClassVar[int]
    POSE_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_FIELD_NUMBER: _ClassVar[int]
    SPIN_FIELD_NUMBER: _ClassVar[int]
    HOLDERS_FIELD_NUMBER: _ClassVar[int]
    RESTING_FIELD_NUMBER: _ClassVar[int]
    id: str
    pose: _geometry_pb2.Pose
    velocity: _geometry_pb2.Vec3
    spin: _geometry_pb2.Vec3
    holders: _containers.RepeatedScalarFieldContainer[str]
    resting: bool
    def __init__(self, id: _Optional[str] = ..., pose: _Optional[_Union[_geometry_pb2.Pose, _Mapping]] = ..., velocity: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., spin: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., holders: _Optional[_Iterable[str]] = ..., resting: _Optional[bool] = ...) -> None: ...

class Contact(_message.Message):
    __slots__ = ("body_a", "body_b", "primitive_a", "primitive_b", "point", "normal", "depth", "force")
    BODY_A_FIELD_NUMBER: _ClassVar[int]
    BODY_B_FIELD_NUMBER: _ClassVar[int]
    PRIMITIVE_A_FIELD_NUMBER: _ClassVar[int]
    PRIMITIVE_B_FIELD_NUMBER: _ClassVar[int]
    POINT_FIELD_NUMBER: _ClassVar[int]
    NORMAL_FIELD_NUMBER: _ClassVar[int]
    DEPTH_FIELD_NUMBER: _ClassVar[int]
    FORCE_FIELD_NUMBER: _ClassVar[int]
    body_a: str
    body_b: str
    primitive_a: int
    primitive_b: int
    point: _geometry_pb2.Vec3
    normal: _geometry_pb2.Vec3
    depth: float
    force: float
    def __init__(self, body_a: _Optional[str] = ..., body_b: _Optional[str] = ..., primitive_a: _Optional[int] = ..., primitive_b: _Optional[int] = ..., point: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., normal: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., depth: _Optional[float] = ..., force: _Optional[float] = ...) -> None: ...

class Ghost(_message.Message):
    __slots__ = ("target", "source", "kind", "target_primitives", "source_primitives", "compliance_target", "compliance_source", "depth", "priority")
    class Kind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        KIND_UNSPECIFIED: _ClassVar[Ghost.Kind]
        KIND_COLLISION: _ClassVar[Ghost.Kind]
        KIND_CONSTRAINT: _ClassVar[Ghost.Kind]
    KIND_UNSPECIFIED: Ghost.Kind
    KIND_COLLISION: Ghost.Kind
    KIND_CONSTRAINT: Ghost.Kind
    TARGET_FIELD_NUMBER: _ClassVar[int]
    SOURCE_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    TARGET_PRIMITIVES_FIELD_NUMBER: _ClassVar[int]
    SOURCE_PRIMITIVES_FIELD_NUMBER: _ClassVar[int]
    COMPLIANCE_TARGET_FIELD_NUMBER: _ClassVar[int]
    COMPLIANCE_SOURCE_FIELD_NUMBER: _ClassVar[int]
    DEPTH_FIELD_NUMBER: _ClassVar[int]
    PRIORITY_FIELD_NUMBER: _ClassVar[int]
    target: str
    source: str
    kind: Ghost.Kind
    target_primitives: _containers.RepeatedScalarFieldContainer[int]
    source_primitives: _containers.RepeatedScalarFieldContainer[int]
    compliance_target: float
    compliance_source: float
    depth: float
    priority: int
    def __init__(self, target: _Optional[str] = ..., source: _Optional[str] = ..., kind: _Optional[_Union[Ghost.Kind, str]] = ..., target_primitives: _Optional[_Iterable[int]] = ..., source_primitives: _Optional[_Iterable[int]] = ..., compliance_target: _Optional[float] = ..., compliance_source: _Optional[float] = ..., depth: _Optional[float] = ..., priority: _Optional[int] = ...) -> None: ...

class Grasp(_message.Message):
    __slots__ = ("participant", "right", "thing", "hold", "since_ns", "fingers", "seen")
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    RIGHT_FIELD_NUMBER: _ClassVar[int]
    THING_FIELD_NUMBER: _ClassVar[int]
    HOLD_FIELD_NUMBER: _ClassVar[int]
    SINCE_NS_FIELD_NUMBER: _ClassVar[int]
    FINGERS_FIELD_NUMBER: _ClassVar[int]
    SEEN_FIELD_NUMBER: _ClassVar[int]
    participant: str
    right: bool
    thing: str
    hold: _geometry_pb2.Pose
    since_ns: int
    fingers: _containers.RepeatedScalarFieldContainer[int]
    seen: _geometry_pb2.Pose
    def __init__(self, participant: _Optional[str] = ..., right: _Optional[bool] = ..., thing: _Optional[str] = ..., hold: _Optional[_Union[_geometry_pb2.Pose, _Mapping]] = ..., since_ns: _Optional[int] = ..., fingers: _Optional[_Iterable[int]] = ..., seen: _Optional[_Union[_geometry_pb2.Pose, _Mapping]] = ...) -> None: ...

class Ownership(_message.Message):
    __slots__ = ("header", "step", "event", "participant", "thing", "owner", "until_ns")
    class Event(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        EVENT_UNSPECIFIED: _ClassVar[Ownership.Event]
        EVENT_GRANTED: _ClassVar[Ownership.Event]
        EVENT_REJECTED: _ClassVar[Ownership.Event]
        EVENT_TAKEN: _ClassVar[Ownership.Event]
        EVENT_EXPIRED: _ClassVar[Ownership.Event]
        EVENT_RELEASED: _ClassVar[Ownership.Event]
    EVENT_UNSPECIFIED: Ownership.Event
    EVENT_GRANTED: Ownership.Event
    EVENT_REJECTED: Ownership.Event
    EVENT_TAKEN: Ownership.Event
    EVENT_EXPIRED: Ownership.Event
    EVENT_RELEASED: Ownership.Event
    HEADER_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    EVENT_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    THING_FIELD_NUMBER: _ClassVar[int]
    OWNER_FIELD_NUMBER: _ClassVar[int]
    UNTIL_NS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    step: int
    event: Ownership.Event
    participant: str
    thing: str
    owner: str
    until_ns: int
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., step: _Optional[int] = ..., event: _Optional[_Union[Ownership.Event, str]] = ..., participant: _Optional[str] = ..., thing: _Optional[str] = ..., owner: _Optional[str] = ..., until_ns: _Optional[int] = ...) -> None: ...

class Selections(_message.Message):
    __slots__ = ("of",)
    class Selection(_message.Message):
        __slots__ = ("participant", "things")
        PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
        THINGS_FIELD_NUMBER: _ClassVar[int]
        participant: str
        things: _containers.RepeatedScalarFieldContainer[str]
        def __init__(self, participant: _Optional[str] = ..., things: _Optional[_Iterable[str]] = ...) -> None: ...
    OF_FIELD_NUMBER: _ClassVar[int]
    of: _containers.RepeatedCompositeFieldContainer[Selections.Selection]
    def __init__(self, of: _Optional[_Iterable[_Union[Selections.Selection, _Mapping]]] = ...) -> None: ...

class Signals(_message.Message):
    __slots__ = ("raised", "reactions")
    class RaisedHand(_message.Message):
        __slots__ = ("participant", "since_ns", "by_gesture")
        PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
        SINCE_NS_FIELD_NUMBER: _ClassVar[int]
        BY_GESTURE_FIELD_NUMBER: _ClassVar[int]
        participant: str
        since_ns: int
        by_gesture: bool
        def __init__(self, participant: _Optional[str] = ..., since_ns: _Optional[int] = ..., by_gesture: _Optional[bool] = ...) -> None: ...
    class Reacted(_message.Message):
        __slots__ = ("participant", "reaction")
        PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
        REACTION_FIELD_NUMBER: _ClassVar[int]
        participant: str
        reaction: _command_pb2.Reaction
        def __init__(self, participant: _Optional[str] = ..., reaction: _Optional[_Union[_command_pb2.Reaction, str]] = ...) -> None: ...
    RAISED_FIELD_NUMBER: _ClassVar[int]
    REACTIONS_FIELD_NUMBER: _ClassVar[int]
    raised: _containers.RepeatedCompositeFieldContainer[Signals.RaisedHand]
    reactions: _containers.RepeatedCompositeFieldContainer[Signals.Reacted]
    def __init__(self, raised: _Optional[_Iterable[_Union[Signals.RaisedHand, _Mapping]]] = ..., reactions: _Optional[_Iterable[_Union[Signals.Reacted, _Mapping]]] = ...) -> None: ...

class WorldState(_message.Message):
    __slots__ = ("header", "step", "key", "things", "states", "contacts", "ghosts", "grasps", "participants", "hash", "dents", "bonds", "gone", "frame", "check", "order", "selections", "strokes", "signals")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    KEY_FIELD_NUMBER: _ClassVar[int]
    THINGS_FIELD_NUMBER: _ClassVar[int]
    STATES_FIELD_NUMBER: _ClassVar[int]
    CONTACTS_FIELD_NUMBER: _ClassVar[int]
    GHOSTS_FIELD_NUMBER: _ClassVar[int]
    GRASPS_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANTS_FIELD_NUMBER: _ClassVar[int]
    HASH_FIELD_NUMBER: _ClassVar[int]
    DENTS_FIELD_NUMBER: _ClassVar[int]
    BONDS_FIELD_NUMBER: _ClassVar[int]
    GONE_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    CHECK_FIELD_NUMBER: _ClassVar[int]
    ORDER_FIELD_NUMBER: _ClassVar[int]
    SELECTIONS_FIELD_NUMBER: _ClassVar[int]
    STROKES_FIELD_NUMBER: _ClassVar[int]
    SIGNALS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    step: int
    key: bool
    things: _containers.RepeatedCompositeFieldContainer[Thing]
    states: _containers.RepeatedCompositeFieldContainer[ThingState]
    contacts: _containers.RepeatedCompositeFieldContainer[Contact]
    ghosts: _containers.RepeatedCompositeFieldContainer[Ghost]
    grasps: _containers.RepeatedCompositeFieldContainer[Grasp]
    participants: _containers.RepeatedScalarFieldContainer[str]
    hash: int
    dents: _containers.RepeatedCompositeFieldContainer[Dent]
    bonds: _containers.RepeatedCompositeFieldContainer[Bond]
    gone: _containers.RepeatedScalarFieldContainer[int]
    frame: bytes
    check: int
    order: _containers.RepeatedScalarFieldContainer[str]
    selections: Selections
    strokes: _containers.RepeatedCompositeFieldContainer[Stroke]
    signals: Signals
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., step: _Optional[int] = ..., key: _Optional[bool] = ..., things: _Optional[_Iterable[_Union[Thing, _Mapping]]] = ..., states: _Optional[_Iterable[_Union[ThingState, _Mapping]]] = ..., contacts: _Optional[_Iterable[_Union[Contact, _Mapping]]] = ..., ghosts: _Optional[_Iterable[_Union[Ghost, _Mapping]]] = ..., grasps: _Optional[_Iterable[_Union[Grasp, _Mapping]]] = ..., participants: _Optional[_Iterable[str]] = ..., hash: _Optional[int] = ..., dents: _Optional[_Iterable[_Union[Dent, _Mapping]]] = ..., bonds: _Optional[_Iterable[_Union[Bond, _Mapping]]] = ..., gone: _Optional[_Iterable[int]] = ..., frame: _Optional[bytes] = ..., check: _Optional[int] = ..., order: _Optional[_Iterable[str]] = ..., selections: _Optional[_Union[Selections, _Mapping]] = ..., strokes: _Optional[_Iterable[_Union[Stroke, _Mapping]]] = ..., signals: _Optional[_Union[Signals, _Mapping]] = ...) -> None: ...

class ButtonEvent(_message.Message):
    __slots__ = ("header", "step", "joint", "thing", "pressed", "participant")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    JOINT_FIELD_NUMBER: _ClassVar[int]
    THING_FIELD_NUMBER: _ClassVar[int]
    PRESSED_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    step: int
    joint: str
    thing: str
    pressed: bool
    participant: str
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., step: _Optional[int] = ..., joint: _Optional[str] = ..., thing: _Optional[str] = ..., pressed: _Optional[bool] = ..., participant: _Optional[str] = ...) -> None: ...

class WorldDetail(_message.Message):
    __slots__ = ("header", "step", "frame")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    step: int
    frame: bytes
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., step: _Optional[int] = ..., frame: _Optional[bytes] = ...) -> None: ...

class WorldInputs(_message.Message):
    __slots__ = ("header", "step", "motions", "command_ids", "people", "commands", "private_state", "props")
    class Used(_message.Message):
        __slots__ = ("participant", "motion_seq", "left", "epoch")
        PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
        MOTION_SEQ_FIELD_NUMBER: _ClassVar[int]
        LEFT_FIELD_NUMBER: _ClassVar[int]
        EPOCH_FIELD_NUMBER: _ClassVar[int]
        participant: str
        motion_seq: int
        left: bool
        epoch: int
        def __init__(self, participant: _Optional[str] = ..., motion_seq: _Optional[int] = ..., left: _Optional[bool] = ..., epoch: _Optional[int] = ...) -> None: ...
    class Person(_message.Message):
        __slots__ = ("participant", "height_m", "build", "proportions")
        PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
        HEIGHT_M_FIELD_NUMBER: _ClassVar[int]
        BUILD_FIELD_NUMBER: _ClassVar[int]
        PROPORTIONS_FIELD_NUMBER: _ClassVar[int]
        participant: str
        height_m: float
        build: float
        proportions: _motion_pb2.Proportions
        def __init__(self, participant: _Optional[str] = ..., height_m: _Optional[float] = ..., build: _Optional[float] = ..., proportions: _Optional[_Union[_motion_pb2.Proportions, _Mapping]] = ...) -> None: ...
    HEADER_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    MOTIONS_FIELD_NUMBER: _ClassVar[int]
    COMMAND_IDS_FIELD_NUMBER: _ClassVar[int]
    PEOPLE_FIELD_NUMBER: _ClassVar[int]
    COMMANDS_FIELD_NUMBER: _ClassVar[int]
    PRIVATE_STATE_FIELD_NUMBER: _ClassVar[int]
    PROPS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    step: int
    motions: _containers.RepeatedCompositeFieldContainer[WorldInputs.Used]
    command_ids: _containers.RepeatedScalarFieldContainer[str]
    people: _containers.RepeatedCompositeFieldContainer[WorldInputs.Person]
    commands: _containers.RepeatedCompositeFieldContainer[_command_pb2.Command]
    private_state: bytes
    props: _containers.RepeatedCompositeFieldContainer[_motion_pb2.Prop]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., step: _Optional[int] = ..., motions: _Optional[_Iterable[_Union[WorldInputs.Used, _Mapping]]] = ..., command_ids: _Optional[_Iterable[str]] = ..., people: _Optional[_Iterable[_Union[WorldInputs.Person, _Mapping]]] = ..., commands: _Optional[_Iterable[_Union[_command_pb2.Command, _Mapping]]] = ..., private_state: _Optional[bytes] = ..., props: _Optional[_Iterable[_Union[_motion_pb2.Prop, _Mapping]]] = ...) -> None: ...

class WorldSnapshotRequest(_message.Message):
    __slots__ = ("state_only",)
    STATE_ONLY_FIELD_NUMBER: _ClassVar[int]
    state_only: bool
    def __init__(self, state_only: _Optional[bool] = ...) -> None: ...

class WorldSnapshot(_message.Message):
    __slots__ = ("header", "state", "private_state", "since")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    PRIVATE_STATE_FIELD_NUMBER: _ClassVar[int]
    SINCE_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    state: WorldState
    private_state: bytes
    since: _containers.RepeatedCompositeFieldContainer[WorldState]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., state: _Optional[_Union[WorldState, _Mapping]] = ..., private_state: _Optional[bytes] = ..., since: _Optional[_Iterable[_Union[WorldState, _Mapping]]] = ...) -> None: ...

class WorldHandoverRequest(_message.Message):
    __slots__ = ("phase", "term", "place")
    class Phase(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        PHASE_UNSPECIFIED: _ClassVar[WorldHandoverRequest.Phase]
        PHASE_PREPARE: _ClassVar[WorldHandoverRequest.Phase]
        PHASE_TAKE: _ClassVar[WorldHandoverRequest.Phase]
    PHASE_UNSPECIFIED: WorldHandoverRequest.Phase
    PHASE_PREPARE: WorldHandoverRequest.Phase
    PHASE_TAKE: WorldHandoverRequest.Phase
    PHASE_FIELD_NUMBER: _ClassVar[int]
    TERM_FIELD_NUMBER: _ClassVar[int]
    PLACE_FIELD_NUMBER: _ClassVar[int]
    phase: WorldHandoverRequest.Phase
    term: int
    place: str
    def __init__(self, phase: _Optional[_Union[WorldHandoverRequest.Phase, str]] = ..., term: _Optional[int] = ..., place: _Optional[str] = ...) -> None: ...

class WorldHandover(_message.Message):
    __slots__ = ("header", "private_state", "term", "due_ns")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    PRIVATE_STATE_FIELD_NUMBER: _ClassVar[int]
    TERM_FIELD_NUMBER: _ClassVar[int]
    DUE_NS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    private_state: bytes
    term: int
    due_ns: int
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., private_state: _Optional[bytes] = ..., term: _Optional[int] = ..., due_ns: _Optional[int] = ...) -> None: ...

class WorldMoveRequest(_message.Message):
    __slots__ = ("place", "force")
    PLACE_FIELD_NUMBER: _ClassVar[int]
    FORCE_FIELD_NUMBER: _ClassVar[int]
    place: str
    force: bool
    def __init__(self, place: _Optional[str] = ..., force: _Optional[bool] = ...) -> None: ...

class WorldMoveReply(_message.Message):
    __slots__ = ("header", "outcome", "reason", "step")
    class Outcome(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        OUTCOME_UNSPECIFIED: _ClassVar[WorldMoveReply.Outcome]
        OUTCOME_MOVING: _ClassVar[WorldMoveReply.Outcome]
        OUTCOME_LEADS: _ClassVar[WorldMoveReply.Outcome]
        OUTCOME_BEHIND: _ClassVar[WorldMoveReply.Outcome]
    OUTCOME_UNSPECIFIED: WorldMoveReply.Outcome
    OUTCOME_MOVING: WorldMoveReply.Outcome
    OUTCOME_LEADS: WorldMoveReply.Outcome
    OUTCOME_BEHIND: WorldMoveReply.Outcome
    HEADER_FIELD_NUMBER: _ClassVar[int]
    OUTCOME_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    outcome: WorldMoveReply.Outcome
    reason: str
    step: int
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., outcome: _Optional[_Union[WorldMoveReply.Outcome, str]] = ..., reason: _Optional[str] = ..., step: _Optional[int] = ...) -> None: ...

class RoomPlan(_message.Message):
    __slots__ = ("header", "shell", "seats")
    class Seat(_message.Message):
        __slots__ = ("position", "heading")
        POSITION_FIELD_NUMBER: _ClassVar[int]
        HEADING_FIELD_NUMBER: _ClassVar[int]
        position: _geometry_pb2.Vec3
        heading: float
        def __init__(self, position: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., heading: _Optional[float] = ...) -> None: ...
    HEADER_FIELD_NUMBER: _ClassVar[int]
    SHELL_FIELD_NUMBER: _ClassVar[int]
    SEATS_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    shell: bool
    seats: _containers.RepeatedCompositeFieldContainer[RoomPlan.Seat]
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., shell: _Optional[bool] = ..., seats: _Optional[_Iterable[_Union[RoomPlan.Seat, _Mapping]]] = ...) -> None: ...

class AssetRequest(_message.Message):
    __slots__ = ("digest", "part")
    DIGEST_FIELD_NUMBER: _ClassVar[int]
    PART_FIELD_NUMBER: _ClassVar[int]
    digest: str
    part: int
    def __init__(self, digest: _Optional[str] = ..., part: _Optional[int] = ...) -> None: ...

class AssetPart(_message.Message):
    __slots__ = ("header", "parts", "size", "data", "reason")
    HEADER_FIELD_NUMBER: _ClassVar[int]
    PARTS_FIELD_NUMBER: _ClassVar[int]
    SIZE_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    parts: int
    size: int
    data: bytes
    reason: str
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., parts: _Optional[int] = ..., size: _Optional[int] = ..., data: _Optional[bytes] = ..., reason: _Optional[str] = ...) -> None: ...

class JournalStep(_message.Message):
    __slots__ = ("inputs", "motions")
    class Taken(_message.Message):
        __slots__ = ("participant", "seq", "t_ns", "numbers", "joints", "joint_numbers")
        PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
        SEQ_FIELD_NUMBER: _ClassVar[int]
        T_NS_FIELD_NUMBER: _ClassVar[int]
        NUMBERS_FIELD_NUMBER: _ClassVar[int]
        JOINTS_FIELD_NUMBER: _ClassVar[int]
        JOINT_NUMBERS_FIELD_NUMBER: _ClassVar[int]
        participant: str
        seq: int
        t_ns: int
        numbers: bytes
        joints: _containers.RepeatedScalarFieldContainer[str]
        joint_numbers: bytes
        def __init__(self, participant: _Optional[str] = ..., seq: _Optional[int] = ..., t_ns: _Optional[int] = ..., numbers: _Optional[bytes] = ..., joints: _Optional[_Iterable[str]] = ..., joint_numbers: _Optional[bytes] = ...) -> None: ...
    INPUTS_FIELD_NUMBER: _ClassVar[int]
    MOTIONS_FIELD_NUMBER: _ClassVar[int]
    inputs: WorldInputs
    motions: _containers.RepeatedCompositeFieldContainer[JournalStep.Taken]
    def __init__(self, inputs: _Optional[_Union[WorldInputs, _Mapping]] = ..., motions: _Optional[_Iterable[_Union[JournalStep.Taken, _Mapping]]] = ...) -> None: ...

class HandForce(_message.Message):
    __slots__ = ("header", "step", "participant", "right", "force", "torque", "touches", "pull")
    class Digit(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        DIGIT_UNSPECIFIED: _ClassVar[HandForce.Digit]
        DIGIT_THUMB: _ClassVar[HandForce.Digit]
        DIGIT_INDEX: _ClassVar[HandForce.Digit]
        DIGIT_MIDDLE: _ClassVar[HandForce.Digit]
        DIGIT_RING: _ClassVar[HandForce.Digit]
        DIGIT_LITTLE: _ClassVar[HandForce.Digit]
        DIGIT_PALM: _ClassVar[HandForce.Digit]
    DIGIT_UNSPECIFIED: HandForce.Digit
    DIGIT_THUMB: HandForce.Digit
    DIGIT_INDEX: HandForce.Digit
    DIGIT_MIDDLE: HandForce.Digit
    DIGIT_RING: HandForce.Digit
    DIGIT_LITTLE: HandForce.Digit
    DIGIT_PALM: HandForce.Digit
    class Touch(_message.Message):
        __slots__ = ("digit", "body", "point", "normal", "force", "normal_force", "area", "mean_pressure", "peak_pressure", "depth")
        DIGIT_FIELD_NUMBER: _ClassVar[int]
        BODY_FIELD_NUMBER: _ClassVar[int]
        POINT_FIELD_NUMBER: _ClassVar[int]
        NORMAL_FIELD_NUMBER: _ClassVar[int]
        FORCE_FIELD_NUMBER: _ClassVar[int]
        NORMAL_FORCE_FIELD_NUMBER: _ClassVar[int]
        AREA_FIELD_NUMBER: _ClassVar[int]
        MEAN_PRESSURE_FIELD_NUMBER: _ClassVar[int]
        PEAK_PRESSURE_FIELD_NUMBER: _ClassVar[int]
        DEPTH_FIELD_NUMBER: _ClassVar[int]
        digit: HandForce.Digit
        body: str
        point: _geometry_pb2.Vec3
        normal: _geometry_pb2.Vec3
        force: _geometry_pb2.Vec3
        normal_force: float
        area: float
        mean_pressure: float
        peak_pressure: float
        depth: float
        def __init__(self, digit: _Optional[_Union[HandForce.Digit, str]] = ..., body: _Optional[str] = ..., point: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., normal: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., force: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., normal_force: _Optional[float] = ..., area: _Optional[float] = ..., mean_pressure: _Optional[float] = ..., peak_pressure: _Optional[float] = ..., depth: _Optional[float] = ...) -> None: ...
    HEADER_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    PARTICIPANT_FIELD_NUMBER: _ClassVar[int]
    RIGHT_FIELD_NUMBER: _ClassVar[int]
    FORCE_FIELD_NUMBER: _ClassVar[int]
    TORQUE_FIELD_NUMBER: _ClassVar[int]
    TOUCHES_FIELD_NUMBER: _ClassVar[int]
    PULL_FIELD_NUMBER: _ClassVar[int]
    header: _envelope_pb2.Header
    step: int
    participant: str
    right: bool
    force: _geometry_pb2.Vec3
    torque: _geometry_pb2.Vec3
    touches: _containers.RepeatedCompositeFieldContainer[HandForce.Touch]
    pull: _geometry_pb2.Vec3
    def __init__(self, header: _Optional[_Union[_envelope_pb2.Header, _Mapping]] = ..., step: _Optional[int] = ..., participant: _Optional[str] = ..., right: _Optional[bool] = ..., force: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., torque: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ..., touches: _Optional[_Iterable[_Union[HandForce.Touch, _Mapping]]] = ..., pull: _Optional[_Union[_geometry_pb2.Vec3, _Mapping]] = ...) -> None: ...
