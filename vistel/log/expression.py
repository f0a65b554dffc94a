"""Expressions over numbers of a log: "participant.ben.motion.left_wrist.speed > 2 and touch.aiko.ben".

Numbers, dotted names, + - * /, < <= > >= == !=, and, or, not, parentheses, abs, min and max. Names may have dashes, so a minus
stands between spaces. Nothing else of Python is understood, and nothing is ever executed.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from functools import reduce
from typing import Any

import numpy as np

from vistel.arrays import F64

MOST_LETTERS = 1000
"""Longer expressions are refused: nobody types them, and Python's parser takes memory for every bracket."""
_NAME = re.compile(r"[a-zA-Z_][\w-]*(?:\.[\w-]+)+")
_NUMBERED = "_{}"
_OF_TWO: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
    ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
}
_OF_ONE: dict[type[ast.AST], Callable[[Any], Any]] = {ast.USub: np.negative, ast.UAdd: np.positive}
_CALLED: dict[str, Callable[..., Any]] = {
    "abs": np.abs,
    "min": lambda *of: reduce(np.minimum, of),
    "max": lambda *of: reduce(np.maximum, of),
}


class ExpressionError(ValueError):
    """An expression that cannot be understood; the text is one line that says where and why."""


class Expression:
    """A parsed expression; `names` are the numbers in it, each once, in their order."""

    def __init__(self, text: str) -> None:
        """Raises ExpressionError for what is no expression."""
        self.text = text
        if len(text) > MOST_LETTERS:
            raise ExpressionError(f"expression: expected at most {MOST_LETTERS} letters, got {len(text)}")
        found: dict[str, str] = {}
        plain = _NAME.sub(lambda m: found.setdefault(m[0], _NUMBERED.format(len(found))), text)
        self._by_place = {place: name for name, place in found.items()}
        self.names = tuple(found)
        try:
            self._tree = ast.parse(plain.strip(), mode="eval").body
            self._check(self._tree)
        except ExpressionError:
            raise
        except (SyntaxError, ValueError, RecursionError, MemoryError) as e:
            plain = plain.strip()
            at = max(0, min(getattr(e, "offset", None) or 1, len(plain)) - 1)
            rest = re.sub(r"_\d+", lambda m: self._by_place.get(m[0], m[0]), plain[at:])
            where = f" from {rest!r} on" if rest else ""
            expected = "numbers, names, + - * /, comparisons, and, or, not, parentheses"
            raise ExpressionError(f"expression {text!r}: cannot be understood{where}; expected {expected}") from e
        if not self.names:
            raise ExpressionError(f"expression {text!r}: names no number of a log, such as {EXAMPLE}")

    def evaluate(self, values: Mapping[str, F64]) -> F64:
        """What it is at each of N times; true is 1 and false 0. values: (N,) of each of `names`; NaN where not known yet: a
        comparison with that is false."""
        with np.errstate(all="ignore"):
            return np.asarray(self._value(self._tree, values), np.float64)

    def _check(self, node: ast.expr) -> None:
        match node:
            case ast.Constant(value=bool()) | ast.Constant(value=int() | float()):
                return
            case ast.Name(id=place) if place in self._by_place:
                return
            case ast.Name(id=name):
                raise ExpressionError(f"expression {self.text!r}: {name!r} is no number; names have dots, as in {EXAMPLE}")
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OF_TWO:
                inner = [left, right]
            case ast.UnaryOp(op=op, operand=operand) if type(op) in _OF_ONE or isinstance(op, ast.Not):
                inner = [operand]
            case ast.BoolOp(values=inner):
                pass
            case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _OF_TWO for op in ops):
                inner = [left, *others]
            case ast.Call(func=ast.Name(id=name), args=inner, keywords=[]) if name in _CALLED and inner:
                if name == "abs" and len(inner) != 1:
                    raise ExpressionError(f"expression {self.text!r}: abs takes one number")
            case _:
                what = type(node).__name__
                raise ExpressionError(f"expression {self.text!r}: {what} is not understood; there are + - * / < > and or not")
        for each in inner:
            self._check(each)

    def _value(self, node: ast.expr, values: Mapping[str, F64]) -> Any:
        match node:
            case ast.Constant(value=value):
                return np.float64(value)  # pyright: ignore[reportArgumentType]  (a number: `_check`)
            case ast.Name(id=place):
                return values[self._by_place[place]]
            case ast.BinOp(left=left, op=op, right=right):
                return _OF_TWO[type(op)](self._value(left, values), self._value(right, values))
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return ~_true(self._value(operand, values))
            case ast.UnaryOp(op=op, operand=operand):
                return _OF_ONE[type(op)](self._value(operand, values))
            case ast.BoolOp(op=op, values=of):
                both = np.logical_and if isinstance(op, ast.And) else np.logical_or
                return reduce(both, (_true(self._value(each, values)) for each in of))
            case ast.Compare(left=left, ops=ops, comparators=others):
                sides = [self._value(each, values) for each in (left, *others)]
                told = (_OF_TWO[type(op)](a, b) for op, a, b in zip(ops, sides, sides[1:], strict=False))
                return reduce(np.logical_and, told)
            case ast.Call(func=ast.Name(id=name), args=of):
                return _CALLED[name](*(self._value(each, values) for each in of))
            case _:
                raise AssertionError(node)


EXAMPLE = "participant.ben.motion.left_wrist.speed"
"""A name, for messages."""


def _true(value: Any) -> Any:
    """What is not 0, and is known."""
    array = np.asarray(value, np.float64)
    return (array != 0.0) & ~np.isnan(array)
