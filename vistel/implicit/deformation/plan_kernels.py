"""A frame of the deformation up to its solves, for an engine that solves elsewhere: which bodies meet, how deep, and
that as lists of integers."""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.implicit.deformation import deform_table as table
from vistel.implicit.deformation.deform_kernels import _evaluate_near, _forget, _set_zones
from vistel.implicit.deformation.field_kernels import T
from vistel.implicit.deformation.meet_kernels import evaluate_touching, list_pairs, own_mask, threshold
from vistel.implicit.deformation.pose_kernels import pose_body
from vistel.jit.addresses import floats, ints, longs, octets
from vistel.jit.kernel_jit import fast, fast_inner
from vistel.jit.pointers import at

BLOCK_WORDS = 8
PAIR_WORDS = 8


@fast
def begin_frame(t, a, b, vertices):
    """Pose the body at a, b (P, 3) and list what may meet, from the middles of blocks and patches in vertices
    (V, 3), which alone need be there. Returns how many blocks and pairs; more pairs than there is room for: nothing
    is listed."""
    _forget(t)
    pose_body(t, a, b)
    return list_pairs(t, a, b, vertices, np.empty(4), np.empty(t[table.OWN_GROUPS], np.int32))


@fast
def near_blocks(t, count, out):
    """Blocks of the first `count` whose skin somebody may reach, into `out`; how many."""
    listed, pairs, height, n = ints(t[table.LISTED_BLOCKS]), ints(t[table.PAIRS]), floats(t[table.HEIGHT]), 0
    for c in range(count):
        for k in range(listed[3 * c + 1], listed[3 * c + 2]):
            rule = pairs[k * table.PAIR + table.PAIR_RULE]
            if rule in (table.COLLIDES, table.NEIGHBOUR) and height[k] > T:
                out[n] = listed[3 * c]
                n += 1
                break
    return n


@fast
def measure_touch(t, count, vertices, normals, out):
    """Measure penetrations on the blocks that `near_blocks` found, whose vertices and normals (V, 3) must be there. Writes
    the further blocks that decide what acts into `out` and returns how many."""
    evaluate_touching(t, count, vertices, normals)
    _set_zones(t)
    listed, pairs, height = ints(t[table.LISTED_BLOCKS]), ints(t[table.PAIRS]), floats(t[table.HEIGHT])
    low, reach = floats(t[table.LOW]), floats(t[table.REACH])
    hinge, bent, gathered, n = ints(t[table.HINGE]), octets(t[table.BENT]), octets(t[table.GATHERED]), 0
    for c in range(count):
        b = listed[3 * c]
        if gathered[b] != 0:
            continue
        acts, wanted = hinge[b] >= 0 and bent[hinge[b]] != 0, False
        for k in range(listed[3 * c + 1], listed[3 * c + 2]):
            pair = at(pairs, k * table.PAIR)
            least = threshold(pair[table.PAIR_RULE], reach[pair[table.PAIR_GROUP]])
            acts = acts or height[k] > least
            wanted = wanted or low[k] <= least < height[k]
        if acts and wanted:
            out[n] = b
            n += 1
    return n


@fast
def judge_frame(t, count, vertices, normals):
    """Find what acts, with the vertices and normals (V, 3) of the blocks found so far."""
    _evaluate_near(t, count, vertices, normals)


@fast_inner
def _members(first, last, mask, kind, out, n):
    """Rows and kinds of the primitives of `mask` (bits from `first`), from place n on; the place after them."""
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            if n < len(out):
                out[n, 0], out[n, 1] = k, kind[k]
            n += 1
    return n


@fast
def write_frame(t, count, vertices, block_words, pair_words, pair_bits, members):
    """Who acts, after `judge_frame`.

    block_words (NB, BLOCK_WORDS): first and last pair, own members from and to; primitives across the hinge from and
    to, joint sphere or -1, 1 where the block acts. pair_words (NP, PAIR_WORDS): rule, overlap row, members from and
    to; effect, first parameter, bits of the quotient, bits of the zone (pair_bits: the same memory as float32).
    members (NM, 2): row, kind. Returns how many blocks, pairs and members there are; of members beyond the room only
    the number counts.
    """
    listed, pairs = ints(t[table.LISTED_BLOCKS]), ints(t[table.PAIRS])
    start, kind, group = ints(t[table.GROUP_START]), ints(t[table.KIND]), ints(t[table.GROUP])
    hinge, other = ints(t[table.HINGE]), ints(t[table.OTHER])
    effect, parameter = ints(t[table.EFFECT]), ints(t[table.PARAMETER_START])
    quotient, zone = floats(t[table.QUOTIENT]), floats(t[table.ZONE])
    block_words[:] = 0
    acting, n, m = 0, 0, 0
    for c in range(count):
        b = listed[3 * c]
        if b < 0:
            continue
        g, first = group[b], n
        for k in range(listed[3 * c + 1], listed[3 * c + 2]):
            pair = at(pairs, k * table.PAIR)
            if not pair[table.PAIR_COUNTS]:
                continue
            of, begin = pair[table.PAIR_GROUP], m
            if pair[table.PAIR_RULE] != table.FORCE:
                m = _members(start[of], start[of + 1], longs(t[table.MASK])[k], kind, members, m)
            pair_words[n, 0], pair_words[n, 1] = pair[table.PAIR_RULE], pair[table.PAIR_OVERLAP]
            pair_words[n, 2], pair_words[n, 3] = begin, m
            pair_words[n, 4], pair_words[n, 5] = effect[of], parameter[of]
            pair_bits[n, 6], pair_bits[n, 7] = quotient[of], zone[of]
            n += 1
        block_words[b, 0], block_words[b, 1], block_words[b, 2] = first, n, m
        m = _members(start[g], start[g + 1], own_mask(t, b, g, vertices), kind, members, m)
        block_words[b, 3], block_words[b, 6], block_words[b, 7] = m, -1, 1
        if hinge[b] >= 0:
            o = other[b]
            block_words[b, 4], block_words[b, 5], block_words[b, 6] = start[o], start[o + 1], hinge[b]
        acting += 1
    return acting, n, m
