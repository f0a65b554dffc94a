"""How a FieldProgram is laid out in flat arrays: what the CPU kernels and a GPU path both read.

All lengths are relative to the program's origin.

| array | form | holds |
|---|---|---|
| leaf | (n, 5) int32 | kind; 1 where its kernel writes F itself; start in params; of its frame or -1; blend family |
| scale | (n, 2) | weight; warp of the blend |
| box | (n, 6) | low and high corner of the realm |
| capsule | (n, 7) | two points and a radius that hold the realm |
| attribute | (n, C) | what the leaf adds to each attribute channel for each unit of field, see `AttributeLayout` |
| params | (k,) | the kinds' numbers; a frame is nine of the map into it, row by row, then its origin |
| node | (m, 6) int32 | operation; first leaf, last + 1; first child, last + 1; register. Root last |
| number | (m, 4) | three numbers of the operation; the field out of reach |
| child, child_weight | (c,) | children of the nodes, and their weights in a sum |
| tree_box | (t, 6) | boxes of the hierarchy, depth first |
| tree_link | (t, 3) int32 | where to go on when the box is missed; range in tree_order |
| tree_order | (n,) int32 | leaves at the bottom of the hierarchy |
| group | (g, 2) int32 | first channel and length of each attribute that is divided by the channel after it |
| registers | int | registers that the nodes need |
"""

KIND = 0
VALUE = 1
START = 2
FRAME = 3
FAMILY = 4
LEAF_WORDS = 5
OP = 0
LEAF0 = 1
LEAF1 = 2
CHILD0 = 3
CHILD1 = 4
REGISTER = 5
NODE_WORDS = 6
NUMBER_WORDS = 4
FAR = 3
"""Column of `number`: the field out of reach."""
SUM = 0
MAX = 1
MIN = 2
UNION = 3
INTERSECTION = 4
COMPLEMENT = 5
DIFF = 6
RAISED = 7
DEFICIT = 8
PLATEAU = 9
PRODUCT = 10
GHOSTED = 11
LANES = 512
"""Points in a block."""
