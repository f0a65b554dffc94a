"""The integers of a frame to bytes and back, by a range coder with static models.

Integer arithmetic only, below 2^53: every machine gives the same bits, and a decoder can be written where numbers are
doubles. Both directions run the same `_header` and `_numbers`, so they agree. docs/reference/motion-stream.md has the layout.
"""

# pyright: basic

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np

# `vistel.wire` may not import `vistel.jit`. Numba's own cache suffices: these kernels call none of another file.
_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_compiled: Any = nb.njit(**_OPTIONS)
# What only kernels call needs no entry from Python; without one it compiles in two thirds of the time.
_INNER_OPTIONS: dict[str, Any] = {**_OPTIONS, "no_cpython_wrapper": True}
_inner: Any = nb.njit(**_INNER_OPTIONS)

# Indices into the range coder's state.
LOW = 0  # lower end of the interval; encoder only, up to 33 bits
RANGE = 1  # width of the interval
CACHE = 2  # last byte that a carry may still change
PENDING = 3  # bytes held back until no carry can change them, CACHE included
AT = 4  # index of the next byte
CODE = 5  # the bytes read, relative to LOW; decoder only
SIZE = 6  # number of bytes; decoder only
STATE_SIZE = 7
TOP = 1 << 24
FULL_RANGE = (1 << 32) - 1

# Indices into a header.
IS_FULL = 0  # 1: refers to no other frame
VERSION = 1  # of the format
PARTS = 2  # bits of the optional parts
GRAIN = 3  # index of `GRAINS_TENTHS`
KEEP = 4  # 1: later frames may refer to this one
DISTANCE = 5  # frames since the reference
STALE = 6  # parts whose sensor is silent, or SAME
SPAN = 7  # frames from the reference to its own reference; of the reference, not sent
HEADER_SIZE = 8
WORK_SIZE = HEADER_SIZE + STATE_SIZE
"""Of a kernel's `work`: the header, then the state."""
SAME = -1
"""Value of STALE: as in the reference; in a full frame, none."""

# Kinds of frames.
FULL = 0  # without reference
AFTER_FULL = 1  # refers to a key frame without reference
AFTER_CHANGE = 2  # refers to a key frame that has a reference of its own

# Indices into a group's weights: the features from which the size of a residual is estimated.
NEAR = 0  # size of the last residual
NEAR_2 = 1  # of the one before it
GROUP = 2  # running mean of the group
ALL = 3  # running mean of all
CHANGE = 4  # change predicted from the reference and its own reference
PARTNER = 5  # size of the partner's residual
FEATURES = 6

LOGS = 64
AGES = 32
SIZES = 4
"""Numbers before the arrays of a table; see `model.packed`."""
MIDDLE = 20
ESCAPE_BITS = 24


@_inner
def _shift_out(s, out):
    if s[LOW] < 0xFF000000 or s[LOW] > FULL_RANGE:
        carry = s[LOW] >> 32
        if s[PENDING] > 0:
            _byte(s, out, s[CACHE] + carry)
            for _ in range(s[PENDING] - 1):
                _byte(s, out, 0xFF + carry)
            s[PENDING] = 0
        s[CACHE] = (s[LOW] >> 24) & 0xFF
    s[PENDING] += 1
    s[LOW] = (s[LOW] & 0x00FFFFFF) << 8


@_inner
def _byte(s, out, value):
    # The coder's first byte is always 0 and is not sent.
    if s[AT] >= 0 and s[AT] < out.size:
        out[s[AT]] = value & 0xFF
    s[AT] += 1


@_inner
def _next(s, data):
    byte = np.int64(data[s[AT]]) if s[AT] < s[SIZE] else np.int64(0)
    s[AT] += 1
    return byte


@_inner
def _code(s, data, encode, cumulative, width, bits):
    """Encode one symbol of a model whose widths add up to 2^bits. Decoding: only the target; then `_consume` the symbol."""
    r = s[RANGE] >> bits
    if encode:
        s[LOW] += r * cumulative
        s[RANGE] = r * width
        while s[RANGE] < TOP:
            s[RANGE] <<= 8
            _shift_out(s, data)
        return 0
    return min(s[CODE] // r, (1 << bits) - 1)


@_inner
def _consume(s, data, cumulative, width, bits):
    r = s[RANGE] >> bits
    s[CODE] -= r * cumulative
    s[RANGE] = r * width
    while s[RANGE] < TOP:
        s[RANGE] <<= 8
        s[CODE] = ((s[CODE] << 8) & FULL_RANGE) | _next(s, data)


@_inner
def _bits(s, data, encode, value, bits):
    """A number of at most 12 bits, all equally likely."""
    bits = np.int64(bits)  # a constant would make `_code` another function for each number
    if encode:
        _code(s, data, True, value, 1, bits)
        return value
    found = _code(s, data, False, 0, 0, bits)
    _consume(s, data, found, 1, bits)
    return found


@_inner
def _flag(s, data, encode, value, share):
    """0 or 1; share: probability of 1, in 4096ths."""
    share = np.int64(share)
    if encode:
        if value:
            _code(s, data, True, 0, share, 12)
        else:
            _code(s, data, True, share, 4096 - share, 12)
        return value
    if _code(s, data, False, 0, 0, 12) < share:
        _consume(s, data, 0, share, 12)
        return 1
    _consume(s, data, share, 4096 - share, 12)
    return 0


@_inner
def _exp_golomb(s, data, encode, value):
    """An unbounded number from 0 in exponential-Golomb code of order 0."""
    length = 0
    while length < ESCAPE_BITS and _bits(s, data, encode, np.int64((value + 1) >> (length + 1) > 0), 1):
        length += 1
    found = np.int64(1)
    for k in range(length):
        at = length - 1 - k
        found = found * 2 + _bits(s, data, encode, ((value + 1) >> at) & 1, 1)
    return found - 1


@_inner
def _residual(s, data, encode, value, cumulative, shift):
    """A signed number: its high part by a static model, its `shift` low bits as they are."""
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
        _consume(s, data, cumulative[symbol], cumulative[symbol + 1] - cumulative[symbol], 15)
        high = symbol - MIDDLE
    if symbol == 0:
        high = -MIDDLE - _exp_golomb(s, data, encode, -MIDDLE - high)
    elif symbol == last:
        high = last - MIDDLE + _exp_golomb(s, data, encode, high - (last - MIDDLE))
    if shift:
        low = _bits(s, data, encode, low, shift)
    return (high << shift) + low


@_inner
def _log(x, logs):
    """About 16 log2(1 + 2x), from the table."""
    more = np.int64(0)
    while x >= LOGS:
        x >>= 1
        more += 16
    return logs[x] + more


@_inner
def _scaled(a, b, c):
    """a * b / c, rounded towards zero; b, c not negative."""
    p = abs(a) * b // c
    return -p if a < 0 else p


@_inner
def _numbers(s, data, encode, values, reference, change, kind, distance, span, present, table):
    """Code all numbers of the parts that are present, in order; `values` is read or written. present: a bit for each part."""
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
    deviations = np.zeros(n, np.int64)  # from the prediction without partner
    sizes = np.zeros(n, np.int64)  # of the residuals
    groups = np.zeros(n_groups, np.int64)
    everything = np.int64(0)
    near = np.int64(0)
    near_2 = np.int64(0)
    far = min(distance, AGES) - 1 if distance > 0 else 0
    reach = min(distance, 2 * span)
    for c in range(n):
        if not (present >> part[c]) & 1:
            values[c] = 0
            continue
        p = partner[c]
        with_partner = p >= 0 and (present >> part[p]) & 1
        expected = np.int64(mean[c])
        if kind != FULL:
            expected = np.int64(reference[c])
            if kind == AFTER_CHANGE:
                expected += _scaled(change[c], go_on[c] * reach, 256 * span)
        base = expected
        if with_partner:
            expected += _scaled(deviations[p], abs(follow[c]), 256) * (1 if follow[c] >= 0 else -1)
        expected = min(max(expected, np.int64(low[c])), np.int64(high[c]))
        g = group[c]
        w = weights[g * FEATURES : (g + 1) * FEATURES]
        size_estimate = (
            bias[c]
            + age[g * AGES + far]
            + w[NEAR] * _log(near, logs)
            + w[NEAR_2] * _log(near_2, logs)
            + w[GROUP] * _log(groups[g] >> 4, logs)
            + w[ALL] * _log(everything >> 4, logs)
        )
        if kind == AFTER_CHANGE:
            size_estimate += w[CHANGE] * _log(abs(_scaled(change[c], reach, span)), logs)
        if with_partner:
            size_estimate += w[PARTNER] * _log(sizes[p], logs)
        model = min(max(size_estimate >> 9, 0), n_models - 1)
        row = at + model * width
        r = _residual(s, data, encode, values[c] - expected, table[row : row + width], np.int64(shifts[model]))
        if not encode:
            values[c] = min(max(expected + r, np.int64(low[c])), np.int64(high[c]))
        deviations[c] = values[c] - base
        size = min(abs(r), 4095)
        sizes[c] = size
        near_2, near = near, size
        groups[g] += ((size << 6) - groups[g]) >> 1
        everything += ((size << 6) - everything) >> 3


@_inner
def _header(s, data, encode, header):
    """Code the header; `header` is read or written."""
    header[IS_FULL] = _flag(s, data, encode, header[IS_FULL], 256)
    if header[IS_FULL]:
        header[VERSION] = _bits(s, data, encode, header[VERSION], 8)
        header[PARTS] = _bits(s, data, encode, header[PARTS], 8)
        header[GRAIN] = _bits(s, data, encode, header[GRAIN], 3)
        header[KEEP] = 1
    else:
        header[KEEP] = _flag(s, data, encode, header[KEEP], 1024)
        short = _bits(s, data, encode, min(header[DISTANCE] - 1, 3), 2)
        header[DISTANCE] = short + 1 if short < 3 else 4 + _exp_golomb(s, data, encode, header[DISTANCE] - 4)
    if _flag(s, data, encode, np.int64(header[STALE] != SAME), 32):
        header[STALE] = _bits(s, data, encode, header[STALE], 12)
    else:
        header[STALE] = SAME


@_inner
def _kind(header):
    if header[IS_FULL]:
        return FULL
    return AFTER_CHANGE if header[SPAN] > 0 else AFTER_FULL


@_compiled
def quantise(numbers, step, low, high, hysteresis, last, out):
    """(N,) numbers in whole steps from `low` to `high` into `out`, 0 for what is not finite; `last` (N,): the last ones, which stay
    where a number is within `hysteresis` steps of them."""
    for i in range(len(numbers)):
        x = numbers[i] / step[i]
        if not np.isfinite(x):
            x = 0.0
        if not abs(x - last[i]) <= hysteresis:  # at first there is none
            last[i] = np.rint(x)
        last[i] = min(max(last[i], float(low[i])), float(high[i]))
        out[i] = np.int64(last[i])


@_compiled
def encode_frame(out, work, values, reference, change, present, table):
    """Write a frame to `out` (uint8, long enough) and return its size in bytes. work: (WORK_SIZE,) with the header filled in."""
    header, s = work[:HEADER_SIZE], work[HEADER_SIZE:]
    s[:] = 0
    s[RANGE] = FULL_RANGE
    s[PENDING], s[AT] = 1, -1
    _header(s, out, True, header)
    _numbers(s, out, True, values, reference, change, _kind(header), header[DISTANCE], header[SPAN], present, table)
    # The number in the interval with the most trailing zeros, which are not sent.
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
    """Read the header into `work` (WORK_SIZE,), which keeps the coder's state for `decode_frame`."""
    header, s = work[:HEADER_SIZE], work[HEADER_SIZE:]
    s[:] = 0
    s[RANGE], s[SIZE] = FULL_RANGE, data.size
    for _ in range(4):
        s[CODE] = (s[CODE] << 8) | _next(s, data)
    _header(s, data, False, header)


@_compiled
def decode_frame(data, work, values, reference, change, present, table):
    """Read the numbers, after `begin_frame`; False if the bytes are damaged."""
    header, s = work[:HEADER_SIZE], work[HEADER_SIZE:]
    _numbers(s, data, False, values, reference, change, _kind(header), header[DISTANCE], header[SPAN], present, table)
    return s[AT] - 4 <= data.size + 4 and data.size <= s[AT]
