"""A frame's whole numbers to bytes and back; integer arithmetic only, so that every machine gives the same bits.

A range coder with static models. Both directions run the same `_frame`, so they cannot disagree. The layout is told in
docs/reference/motion-stream.md. No number exceeds 2^53, so that a decoder can be written where numbers are doubles.
"""

# pyright: basic

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np

# The wire may not import the mathematics, whose decorator watches over kernels that call each other across files;
# these are all in this file, which Numba's own cache does watch.
_compiled: Any = nb.njit(cache=True, nogil=True, error_model="numpy")

# Places in the range coder's state.
LOW = 0  # lower end of the interval; encoder only, up to 33 bits
RANGE = 1  # width of the interval
CACHE = 2  # last byte that a carry may still change
WAITING = 3  # bytes held back until a carry is excluded, that one included
AT = 4  # byte that is written or read next
CODE = 5  # where in the interval the bytes read point; decoder only
SIZE = 6  # bytes to read
STATE_SIZE = 7
TOP = 1 << 24
FULL_RANGE = (1 << 32) - 1

# Places in a header.
IS_FULL = 0  # 1: refers to no other frame
VERSION = 1  # of the format
HAS = 2  # which optional parts there are
GRAIN = 3  # index of `GRAINS_TENTHS`: how fine the steps are
KEEP = 4  # 1: later frames may refer to this one
DISTANCE = 5  # frames since the reference
STALE = 6  # parts whose sensor is silent, or SAME
SPAN = 7  # frames from the reference to its own reference; of the reference, not sent
HEADER_SIZE = 8
WORK_SIZE = HEADER_SIZE + STATE_SIZE
"""Of the array that a kernel takes for both, the header first."""
SAME = -1
"""STALE as in the reference; in a full frame: none."""

# Kinds of frames.
FULL = 0  # without reference
AFTER_FULL = 1  # refers to a key frame without reference
AFTER_CHANGE = 2  # refers to a key frame that has a reference of its own

# Places among a group's weights: what the expected size of a residual is made of.
NEAR = 0  # size of the last residual
NEAR_2 = 1  # of the one before it
GROUP = 2  # running mean of the group
ALL = 3  # running mean of all
CHANGE = 4  # change expected from the reference and its own reference
PARTNER = 5  # size of the partner's residual
FEATURES = 6

LOGS = 64
AGES = 32
SIZES = 4
"""How many sizes stand at the beginning of a table; see `model.packed`."""
MIDDLE = 20
ESCAPE_BITS = 24


@_compiled
def _shift_out(s, out):
    if s[LOW] < 0xFF000000 or s[LOW] > FULL_RANGE:
        carry = s[LOW] >> 32
        if s[WAITING] > 0:
            _byte(s, out, s[CACHE] + carry)
            for _ in range(s[WAITING] - 1):
                _byte(s, out, 0xFF + carry)
            s[WAITING] = 0
        s[CACHE] = (s[LOW] >> 24) & 0xFF
    s[WAITING] += 1
    s[LOW] = (s[LOW] & 0x00FFFFFF) << 8


@_compiled
def _byte(s, out, value):
    # The first byte out of the coder is always 0 and is not sent.
    if s[AT] >= 0 and s[AT] < out.size:
        out[s[AT]] = value & 0xFF
    s[AT] += 1


@_compiled
def _next(s, data):
    byte = np.int64(data[s[AT]]) if s[AT] < s[SIZE] else np.int64(0)
    s[AT] += 1
    return byte


@_compiled
def _code(s, data, encode, cumulative, width, bits):
    """One symbol of a model whose widths add up to 2^bits. Decoding: only brings the target; see `_took`."""
    r = s[RANGE] >> bits
    if encode:
        s[LOW] += r * cumulative
        s[RANGE] = r * width
        while s[RANGE] < TOP:
            s[RANGE] <<= 8
            _shift_out(s, data)
        return 0
    return min(s[CODE] // r, (1 << bits) - 1)


@_compiled
def _took(s, data, cumulative, width, bits):
    r = s[RANGE] >> bits
    s[CODE] -= r * cumulative
    s[RANGE] = r * width
    while s[RANGE] < TOP:
        s[RANGE] <<= 8
        s[CODE] = ((s[CODE] << 8) & FULL_RANGE) | _next(s, data)


@_compiled
def _bits(s, data, encode, value, bits):
    """A number of at most 12 bits, all values alike."""
    if encode:
        _code(s, data, True, value, 1, bits)
        return value
    found = _code(s, data, False, 0, 0, bits)
    _took(s, data, found, 1, bits)
    return found


@_compiled
def _flag(s, data, encode, value, share):
    """0 or 1; share: of 1, in 4096ths."""
    if encode:
        if value:
            _code(s, data, True, 0, share, 12)
        else:
            _code(s, data, True, share, 4096 - share, 12)
        return value
    if _code(s, data, False, 0, 0, 12) < share:
        _took(s, data, 0, share, 12)
        return 1
    _took(s, data, share, 4096 - share, 12)
    return 0


@_compiled
def _many(s, data, encode, value):
    """A number from 0 of any size: how many bits it has after adding 1, then these."""
    length = 0
    while length < ESCAPE_BITS and _bits(s, data, encode, np.int64((value + 1) >> (length + 1) > 0), 1):
        length += 1
    found = np.int64(1)
    for k in range(length):
        at = length - 1 - k
        found = found * 2 + _bits(s, data, encode, ((value + 1) >> at) & 1, 1)
    return found - 1


@_compiled
def _residual(s, data, encode, value, cumulative, shift):
    """A signed number by a model: its high part by the table, the low bits as they are."""
    last = cumulative.size - 2
    high, low = value >> shift, value & ((1 << shift) - 1)
    symbol = min(max(high + MIDDLE, 0), last)
    if encode:
        _code(s, data, True, cumulative[symbol], cumulative[symbol + 1] - cumulative[symbol], 15)
    else:
        target = _code(s, data, False, 0, 0, 15)
        symbol = np.int64(0)
        step = np.int64(32)
        while step:
            if symbol + step <= last and cumulative[symbol + step] <= target:
                symbol += step
            step >>= 1
        _took(s, data, cumulative[symbol], cumulative[symbol + 1] - cumulative[symbol], 15)
        high = symbol - MIDDLE
    if symbol == 0:
        high = -MIDDLE - _many(s, data, encode, -MIDDLE - high)
    elif symbol == last:
        high = last - MIDDLE + _many(s, data, encode, high - (last - MIDDLE))
    if shift:
        low = _bits(s, data, encode, low, shift)
    return (high << shift) + low


@_compiled
def _log(x, logs):
    """16 log2(1 + 2x), about; from the table, for large x by halving."""
    more = np.int64(0)
    while x >= LOGS:
        x >>= 1
        more += 16
    return logs[x] + more


@_compiled
def _scaled(a, b, c):
    """a * b / c, cut off towards zero; b, c not negative."""
    p = abs(a) * b // c
    return -p if a < 0 else p


@_compiled
def _numbers(s, data, encode, values, reference, change, kind, distance, span, there, table):
    """The numbers of every part that the frame has, in order; `values` is read or written. there: a bit for each part."""
    n, n_groups, n_models, width = table[0], table[1], table[2], table[3]
    at = SIZES
    part, group, low, high = (
        table[at : at + n],
        table[at + n : at + 2 * n],
        table[at + 2 * n : at + 3 * n],
        table[at + 3 * n : at + 4 * n],
    )
    at += 4 * n
    mean, partner, go_on = table[at : at + n], table[at + n : at + 2 * n], table[at + 2 * n : at + 3 * n]
    at += 3 * n
    follow, bias = table[at + kind * n : at + (kind + 1) * n], table[at + (3 + kind) * n : at + (4 + kind) * n]
    at += 6 * n
    age = table[at + kind * n_groups * AGES : at + (kind + 1) * n_groups * AGES]
    at += 3 * n_groups * AGES
    weights = table[at + kind * n_groups * FEATURES : at + (kind + 1) * n_groups * FEATURES]
    at += 3 * n_groups * FEATURES
    logs, shifts = table[at : at + LOGS], table[at + LOGS : at + LOGS + n_models]
    at += LOGS + n_models
    left = np.zeros(n, np.int64)  # what the partner's rule did not foresee, with sign
    sizes = np.zeros(n, np.int64)  # what no rule foresaw
    groups = np.zeros(n_groups, np.int64)
    everything = np.int64(0)
    near = np.int64(0)
    near_2 = np.int64(0)
    far = min(distance, AGES) - 1 if distance > 0 else 0
    reach = min(distance, 2 * span)
    for c in range(n):
        if not (there >> part[c]) & 1:
            values[c] = 0
            continue
        p = partner[c]
        with_partner = p >= 0 and (there >> part[p]) & 1
        expected = np.int64(mean[c])
        if kind != FULL:
            expected = np.int64(reference[c])
            if kind == AFTER_CHANGE:
                expected += _scaled(change[c], go_on[c] * reach, 256 * span)
        base = expected
        if with_partner:
            expected += _scaled(left[p], abs(follow[c]), 256) * (1 if follow[c] >= 0 else -1)
        expected = min(max(expected, np.int64(low[c])), np.int64(high[c]))
        g = group[c]
        w = weights[g * FEATURES : (g + 1) * FEATURES]
        about = (
            bias[c]
            + age[g * AGES + far]
            + w[NEAR] * _log(near, logs)
            + w[NEAR_2] * _log(near_2, logs)
            + w[GROUP] * _log(groups[g] >> 4, logs)
            + w[ALL] * _log(everything >> 4, logs)
        )
        if kind == AFTER_CHANGE:
            about += w[CHANGE] * _log(abs(_scaled(change[c], reach, span)), logs)
        if with_partner:
            about += w[PARTNER] * _log(sizes[p], logs)
        model = min(max(about >> 9, 0), n_models - 1)
        row = at + model * width
        r = _residual(s, data, encode, values[c] - expected, table[row : row + width], np.int64(shifts[model]))
        if not encode:
            values[c] = min(max(expected + r, np.int64(low[c])), np.int64(high[c]))
        left[c] = values[c] - base
        size = min(abs(r), 4095)
        sizes[c] = size
        near_2, near = near, size
        groups[g] += ((size << 6) - groups[g]) >> 1
        everything += ((size << 6) - everything) >> 3


@_compiled
def _header(s, data, encode, header):
    """header: kind of reference and what is told of it; see `HEADER`."""
    header[IS_FULL] = _flag(s, data, encode, header[IS_FULL], 256)
    if header[IS_FULL]:
        header[VERSION] = _bits(s, data, encode, header[VERSION], 8)
        header[HAS] = _bits(s, data, encode, header[HAS], 8)
        header[GRAIN] = _bits(s, data, encode, header[GRAIN], 3)
        header[KEEP] = 1
    else:
        header[KEEP] = _flag(s, data, encode, header[KEEP], 1024)
        short = _bits(s, data, encode, min(header[DISTANCE] - 1, 3), 2)
        header[DISTANCE] = short + 1 if short < 3 else 4 + _many(s, data, encode, header[DISTANCE] - 4)
    if _flag(s, data, encode, np.int64(header[STALE] != SAME), 32):
        header[STALE] = _bits(s, data, encode, header[STALE], 12)
    else:
        header[STALE] = SAME


@_compiled
def _kind(header):
    if header[IS_FULL]:
        return FULL
    return AFTER_CHANGE if header[SPAN] > 0 else AFTER_FULL


@_compiled
def encode_frame(out, work, values, reference, change, there, table):
    """Writes a frame to `out` (uint8, long enough); returns the number of bytes. work: (WORK_SIZE,), the header filled in."""
    header, s = work[:HEADER_SIZE], work[HEADER_SIZE:]
    s[:] = 0
    s[RANGE] = FULL_RANGE
    s[WAITING], s[AT] = 1, -1
    _header(s, out, True, header)
    _numbers(s, out, True, values, reference, change, _kind(header), header[DISTANCE], header[SPAN], there, table)
    # The number between low and low + range with the most zeros at its end; zeros at the end are not sent.
    for zeros in range(24, -8, -8):
        mask = (1 << zeros) - 1 if zeros > 0 else 0
        end = (s[LOW] + mask) & ~mask
        if end < s[LOW] + s[RANGE]:
            s[LOW] = end
            break
    for _ in range(5):
        _shift_out(s, out)
    size = s[AT]
    while size > 0 and out[size - 1] == 0:
        size -= 1
    return size


@_compiled
def begin_frame(data, work):
    """Reads the header into `work` (WORK_SIZE,), where the coder's state is kept to go on."""
    header, s = work[:HEADER_SIZE], work[HEADER_SIZE:]
    s[:] = 0
    s[RANGE], s[SIZE] = FULL_RANGE, data.size
    for _ in range(4):
        s[CODE] = (s[CODE] << 8) | _next(s, data)
    _header(s, data, False, header)


@_compiled
def decode_frame(data, work, values, reference, change, there, table):
    """Reads the numbers after `begin_frame`; False where the bytes are no whole frame."""
    header, s = work[:HEADER_SIZE], work[HEADER_SIZE:]
    _numbers(s, data, False, values, reference, change, _kind(header), header[DISTANCE], header[SPAN], there, table)
    return s[AT] - 4 <= data.size + 4 and data.size <= s[AT]
