"""Kernels of the nodes other than sums, with gradients and attributes: extrema, Ricci forms, complement, DIFF, ghosts."""

# pyright: basic, reportCallIssue=false

import math

from vistel.implicit.graph.ghost_kernels import plateau, raised
from vistel.implicit.rows.layout import (
    COMPLEMENT,
    DEFICIT,
    FAR,
    INTERSECTION,
    LANES,
    MAX,
    MIN,
    NODE_WORDS,
    NUMBER_WORDS,
    PLATEAU,
    PRODUCT,
    RAISED,
    REGISTER,
    UNION,
)
from vistel.implicit.rows.row_kernels import F32, row
from vistel.jit.numbers import HALF, ONE, ZERO
from vistel.jit.pointers import at

TIE = F32(1e-6)
MAX_SLOPE = F32(1e6)
NOTHING = F32(1e-30)
"""Fields this small are 0 to a Ricci form: their ratios would leave the range of float32."""


@row
def _operand(node_table, number, child, k, live, regs, channels, i):
    """Field of the k-th child at lane i."""
    node = child[k]
    if live[node] == 0:
        return number[NUMBER_WORDS * node + FAR]
    return regs[node_table[NODE_WORDS * node + REGISTER] * channels * LANES + i]


@row
def _mix(node_table, child, k, live, regs, acc, channels, i, rate, share, slope):
    """Add `rate` times a child's gradient and `share` times its attributes at lane i."""
    node = child[k]
    if live[node] == 0:
        return
    r = at(regs, node_table[NODE_WORDS * node + REGISTER] * channels * LANES)
    first = 4 if slope else 1
    for c in range(1, first):
        acc[c * LANES + i] += rate * r[c * LANES + i]
    for c in range(first, channels):
        acc[c * LANES + i] += share * r[c * LANES + i]


@row
def _power(x, e):
    return F32(math.exp(e * math.log(x))) if x > ZERO else ZERO


@row
def _extremum(largest, node_table, number, child, m, live, regs, acc, channels, i, slope):
    best = _operand(node_table, number, child, 0, live, regs, channels, i)
    which = 0
    for k in range(1, m):
        v = _operand(node_table, number, child, k, live, regs, channels, i)
        if (largest and v > best) or (not largest and v < best):
            best, which = v, k
    acc[i] = best
    if channels > 1:
        for k in range(m):
            v = _operand(node_table, number, child, k, live, regs, channels, i)
            if abs(v - best) <= TIE:
                _mix(node_table, child, k, live, regs, acc, channels, i, ONE if k == which else ZERO, ONE, slope)


@row
def _ricci(union, power, node_table, number, child, m, live, regs, acc, channels, i, slope):
    extreme = max(_operand(node_table, number, child, 0, live, regs, channels, i), ZERO)
    for k in range(1, m):
        v = max(_operand(node_table, number, child, k, live, regs, channels, i), ZERO)
        extreme = max(extreme, v) if union else min(extreme, v)
    if extreme <= NOTHING:
        return
    total = ZERO
    for k in range(m):
        v = max(_operand(node_table, number, child, k, live, regs, channels, i), ZERO)
        total += _power(v / extreme if union else extreme / v, power)
    value = extreme * _power(total, ONE / power if union else -ONE / power)
    acc[i] = value
    if channels > 1:
        for k in range(m):
            v = max(_operand(node_table, number, child, k, live, regs, channels, i), ZERO)
            if union:
                rate = _power(v / value, power - ONE) if v > ZERO or power > ONE else ONE
            else:
                rate = _power(value / v, power + ONE)
            _mix(node_table, child, k, live, regs, acc, channels, i, rate, rate, slope)


@row
def _diff(power, eps, node_table, number, child, live, regs, acc, channels, i, slope):
    a = max(_operand(node_table, number, child, 0, live, regs, channels, i), ZERO)
    b = max(_operand(node_table, number, child, 1, live, regs, channels, i), ZERO)
    s = _power(a, power) - _power(b, power)
    square = s * s + eps * eps
    acc[i] = _power(square, HALF / power) - _power(eps, ONE / power)
    if channels > 1:
        rate = _power(square, HALF / power - ONE) * s
        flat = ONE if power == ONE else ZERO
        da = rate * (_power(a, power - ONE) if a > ZERO else flat)
        db = -rate * (_power(b, power - ONE) if b > ZERO else flat)
        da, db = min(max(da, -MAX_SLOPE), MAX_SLOPE), min(max(db, -MAX_SLOPE), MAX_SLOPE)
        _mix(node_table, child, 0, live, regs, acc, channels, i, da, ONE, slope)
        _mix(node_table, child, 1, live, regs, acc, channels, i, db, ONE, slope)


@row
def _raised(numbers, node_table, number, child, m, live, regs, acc, channels, i, slope):
    field = _operand(node_table, number, child, 0, live, regs, channels, i)
    reach = _operand(node_table, number, child, 1, live, regs, channels, i) if m > 1 else ZERO
    value, by_field, by_reach = raised(field, reach, m > 1, numbers[0], numbers[1], numbers[2])
    acc[i] = value
    if channels > 1:
        _mix(node_table, child, 0, live, regs, acc, channels, i, by_field, ZERO, slope)
        if m > 1:
            _mix(node_table, child, 1, live, regs, acc, channels, i, by_reach, ZERO, slope)


@row
def _product(node_table, number, child, m, live, regs, acc, channels, i, slope):
    value = ONE
    for k in range(m):
        value *= _operand(node_table, number, child, k, live, regs, channels, i)
    acc[i] = value
    if channels > 1:
        for k in range(m):
            rate = ONE
            for j in range(m):
                if j != k:
                    rate *= _operand(node_table, number, child, j, live, regs, channels, i)
            _mix(node_table, child, k, live, regs, acc, channels, i, rate, ZERO, slope)


@row
def _ghosted(cap, twice, node_table, number, child, m, live, regs, acc, channels, i, slope):
    own = _operand(node_table, number, child, 0, live, regs, channels, i)
    ghost = _operand(node_table, number, child, 1, live, regs, channels, i)
    value, cut = own, 0
    if own > ZERO:
        value = own + min(ghost, cap)
        for k in range(2, m):
            v = twice - _operand(node_table, number, child, k, live, regs, channels, i)
            if v < value:
                value, cut = v, k
    acc[i] = value
    if channels > 1:
        _mix(node_table, child, 0, live, regs, acc, channels, i, ONE if cut == 0 else ZERO, ONE, slope)
        if cut > 0:
            _mix(node_table, child, cut, live, regs, acc, channels, i, -ONE, ZERO, slope)
        elif own > ZERO and ghost <= cap:
            _mix(node_table, child, 1, live, regs, acc, channels, i, ONE, ZERO, slope)


@row
def _ghost(op, numbers, node_table, number, child, m, live, regs, acc, channels, n, slope):
    """Rows of a node that ghosts are made of."""
    a, b = numbers[0], numbers[1]
    for i in range(n):
        if op == RAISED:
            _raised(numbers, node_table, number, child, m, live, regs, acc, channels, i, slope)
        elif op == DEFICIT:
            y = a - _operand(node_table, number, child, 0, live, regs, channels, i)
            factor = b if y < ZERO else ONE
            acc[i] = factor * y
            if channels > 1:
                _mix(node_table, child, 0, live, regs, acc, channels, i, -factor, ZERO, slope)
        elif op == PLATEAU:
            value, rate = plateau(_operand(node_table, number, child, 0, live, regs, channels, i), a)
            acc[i] = value
            if channels > 1:
                _mix(node_table, child, 0, live, regs, acc, channels, i, rate, ZERO, slope)
        elif op == PRODUCT:
            _product(node_table, number, child, m, live, regs, acc, channels, i, slope)
        else:
            _ghosted(a, b, node_table, number, child, m, live, regs, acc, channels, i, slope)


@row
def combine(op, numbers, node_table, number, child, m, live, regs, acc, channels, n, slope):
    """Rows of one node from those of its m children; `numbers` are its own; acc holds zeros."""
    if op >= RAISED:
        _ghost(op, numbers, node_table, number, child, m, live, regs, acc, channels, n, slope)
        return
    a, b = numbers[0], numbers[1]
    for i in range(n):
        if op in (MAX, MIN):
            _extremum(op == MAX, node_table, number, child, m, live, regs, acc, channels, i, slope)
        elif op in (UNION, INTERSECTION):
            _ricci(op == UNION, a, node_table, number, child, m, live, regs, acc, channels, i, slope)
        elif op == COMPLEMENT:
            acc[i] = a - _operand(node_table, number, child, 0, live, regs, channels, i)
            if channels > 1:
                _mix(node_table, child, 0, live, regs, acc, channels, i, -ONE, ONE, slope)
        else:
            _diff(a, b, node_table, number, child, live, regs, acc, channels, i, slope)
