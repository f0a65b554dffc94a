"""Checks on what a caller hands in: one clear line that names the shape, the argument and what was expected."""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64

Vec3 = tuple[float, float, float]


class ShapeError(ValueError):
    """A shape cannot be made from these arguments."""


def finite(shape: str, name: str, value: float) -> float:
    """`value` as a float; ShapeError unless it is a finite number."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ShapeError(f"{shape}: {name} is {value!r}, expected a number") from None
    if not math.isfinite(number):
        raise ShapeError(f"{shape}: {name} is {number}, expected a finite number")
    return number


def positive(shape: str, name: str, value: float) -> float:
    """`value` as a float; ShapeError unless it is finite and above zero."""
    number = finite(shape, name, value)
    if number <= 0:
        raise ShapeError(f"{shape}: {name} is {number:g}, expected a number above 0")
    return number


def within(shape: str, name: str, value: float, low: float, high: float) -> float:
    """`value` as a float; ShapeError unless low <= value <= high."""
    number = finite(shape, name, value)
    if not low <= number <= high:
        raise ShapeError(f"{shape}: {name} is {number:g}, expected {low:g} to {high:g}")
    return number


def vector(shape: str, name: str, value: Iterable[float]) -> Vec3:
    """`value` as three floats; ShapeError unless it is three finite numbers."""
    try:
        numbers = tuple(float(v) for v in value)
    except (TypeError, ValueError):
        raise ShapeError(f"{shape}: {name} is {value!r}, expected three numbers (x, y, z)") from None
    if len(numbers) != 3:
        raise ShapeError(f"{shape}: {name} has {len(numbers)} numbers, expected three (x, y, z)")
    if not all(math.isfinite(v) for v in numbers):
        raise ShapeError(f"{shape}: {name} is {numbers}, expected finite numbers")
    return numbers


def point_rows(shape: str, name: str, value: ArrayLike) -> F64:
    """`value` as an (n, 3) float64 array of its own; ShapeError unless finite and of that form."""
    try:
        rows = np.array(value, np.float64)
    except (TypeError, ValueError):
        raise ShapeError(f"{shape}: {name} is not an array of points, expected n rows of (x, y, z)") from None
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ShapeError(f"{shape}: {name} has the form {rows.shape}, expected (n, 3)")
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(bad):
        raise ShapeError(f"{shape}: {name} row {bad[0]} is {rows[bad[0]].tolist()}, expected finite numbers")
    return rows


def query_points(points: ArrayLike) -> F64:
    """Query points of any leading form (..., 3) as (n, 3) float64; ValueError otherwise."""
    rows = np.asarray(points, np.float64)
    if rows.ndim == 0 or rows.shape[-1] != 3:
        raise ShapeError(f"points have the form {rows.shape}, expected (..., 3)")
    return rows.reshape(-1, 3)
