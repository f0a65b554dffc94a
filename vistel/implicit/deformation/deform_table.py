"""What a frame of the deformation works on, as one table of addresses (see `addresses`) and sizes.

Shapes: NB blocks, G own groups, P own primitives, H hinges; N ghost primitives and NG groups, own ones first;
NP pairs of a block and a group.
"""

(
    # Blocks: what never changes.
    INDEX,  # (NB, LANES) int32 vertices, the last repeated
    CENTRE,  # (NB, 1 + PATCHES) int32 vertices in the middle of the block and of its patches
    SPREAD,  # likewise, float32: how far the others may be from them [m]
    COUNT,  # (NB,) int32 how many are real
    GROUP,  # (NB,) int32
    HINGE,  # (NB,) int32, -1 none
    OTHER,  # (NB,) int32 group across the hinge, -1 none
    CALIBRATION,  # (NB, PATCHES, CAL_ROWS, WIDTH) float32
    MOST_CONTACT,  # (NB,) float32 largest CONTACT of the block
    MIDDLE_CONTACT,  # (NB,) float32 CONTACT of the vertex in its middle
    OVERLAP,  # (NO, LANES) float32 shares with which neighbours collide
    OVERLAP_ROW,  # (NB, G) int32: -1 none, NO_OVERLAP
    GROUP_BLOCKS,  # (G + 1,) int32 blocks of group g
    SELF_RULE,  # (G, G) int32: 0 none, NEIGHBOUR, COLLIDES
    # The body itself.
    ORDER,  # (P,) int32 primitives sorted by group
    FIT,  # (P, 3) float32 influence radii at both ends [m], weight
    HINGES,  # (H, 4) int32 parent and child primitive (sorted), parent and child group
    REST_BEND,  # (H,) float64 angle at rest [rad], negative: not measured yet
    SPHERE,  # (H, ROW) float32 joint spheres
    BENT,  # (H,) uint8
    REST_SHAPE,  # (G, G, 4) float64 squared distances of the groups' first primitives
    # Ghosts, own groups first.
    ROWS,  # (N, ROW) float32
    BOX,  # (N, 6) float32
    KIND,  # (N,) int32
    CORNERS,  # (NC, 2) float32
    GROUP_START,  # (NG + 1,) int32
    GROUP_BOX,  # (NG, 6) float32
    QUOTIENT,  # (NG,) float32 own compliance / the group's, -1 rigid
    DEPTH,  # (NG,) float32 given penetration, negative: measured
    ALLOWED,  # (NG, G) uint8 whether it acts on an own group
    EFFECT,  # (NG,) int32
    PARAMETER_START,  # (NG + 1,) int32
    PARAMETERS,  # float32
    DELTA,  # (NG,) float32 penetration
    ZONE,  # (NG,) float32 zone of propagation
    REACH,  # (NG,) float32 how far below T (in field units) its field still moves a skin
    # Work.
    CANDIDATES,  # (G, NG) int32 2 k + (1 where k moved along with the group)
    LISTED_BLOCKS,  # (NB, 3) int32 block, its first pair, the next block's
    PAIRS,  # (NP, PAIR) int32
    MASK,  # (NP,) int64 which primitives of its group count, bits from its first
    HEIGHT,  # (NP,) float32 largest weighted field in the block: exact once evaluated, before that a bound
    LOW,  # (NP,) float32 what its height is at least
    MEMBERS,  # (3 P + 8 + N, 2) int32 of one block: rows and kinds of primitives
    ACTING,  # (NG, ACT) int64 of one block: what acts
    SHARE,  # (NG, 2) float32 of one block: quotient and zone of what acts
    RAYS,  # (3 P + 8 + N, 6, WIDTH) float32 of one patch's members
    BLOCK,  # (NB, PATCHES, 6, WIDTH) float32 rigid positions and normals
    GATHERED,  # (NB,) uint8
    WORK,  # float32: a primitive's rays and 3 rows
    RESULT,  # (4, WIDTH) float32
    MOVED,  # (V,) uint8
    LOST,  # (V,) uint8
    MOVED_LIST,  # (V,) int32
    LOST_LIST,  # (V,) int32
    STATS,  # (STAT_COUNT,) int64
    # Sizes.
    BLOCKS,
    OWN_GROUPS,
    OWN_PRIMITIVES,
    HINGE_COUNT,
    GROUPS,
    ALL_GROUPS,  # room for groups: the stride of CANDIDATES
    PAIR_ROOM,
    FLATTENS,  # 1 where a displacement lies on the skin, which others flatten before they touch it
    TABLE_LENGTH,
) = range(64)

# Rows of a patch's calibration.
WEIGHT = 0
OFFSET = 1
CONTACT = 2
MU = 3
ALPHA = 4
INWARD = 5
OUTWARD = 6
CAL_ROWS = 7

# Columns of a pair; PAIR_COUNTS: 1 where it takes part in its block's solve.
PAIR_BLOCK = 0
PAIR_GROUP = 1
PAIR_OVERLAP = 2
PAIR_RULE = 3
PAIR_COUNTS = 4
PAIR = 5
# Columns of what acts on a block: rule, effect; members from, to; overlap row; first parameter.
ACT_RULE = 0
ACT_EFFECT = 1
ACT_FROM = 2
ACT_TO = 3
ACT_OVERLAP = 4
ACT_PARAMETER = 5
ACT = 6
# Rules of a pair: the group belongs to the same skin and only counts in what others see; it is a neighbour
# that pushes by its share; it collides like anyone; it is a force field.
SHOWN = 0
NEIGHBOUR = 1
COLLIDES = 2
FORCE = 3
NO_OVERLAP = -2
"""Overlap row of a neighbour that shares all of a block's skin: it does not collide."""

# Columns of STATS; REPEATS: evaluations after a block's first, by lanes that were still open; LISTED:
# rows of LISTED_BLOCKS.
EVALUATIONS = 0
MOVED_COUNT = 1
LOST_COUNT = 2
SOLVED = 3
PAIR_NEED = 4
REPEATS = 5
LISTED = 6
STAT_COUNT = 7
