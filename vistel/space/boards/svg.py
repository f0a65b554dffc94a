"""A board as an SVG file: each stroke a line with round ends, in millimetres of a board of its first size."""

from collections.abc import Iterable

from vistel.space.boards.board import WHITE
from vistel.space.boards.stroke import ACROSS, UNIT, UPWARDS, Stroke


def svg(strokes: Iterable[Stroke]) -> str:
    """The text of the file; what is drawn later lies over it. Bytes are the same for the same strokes."""
    wide, high = (round(1e3 * UNIT * units) for units in (ACROSS, UPWARDS))
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}mm" height="{high}mm" viewBox="0 0 {ACROSS} {UPWARDS}">',
        f'<rect width="{ACROSS}" height="{UPWARDS}" fill="{_colour(WHITE)}"/>',
        '<g fill="none" stroke-linecap="round" stroke-linejoin="round">',
    ]
    for s in sorted(strokes, key=lambda s: s.number):
        points = s.points.tolist()
        if len(points) == 1:
            points *= 2  # a dot
        line = " ".join(f"{x},{UPWARDS - y}" for x, y in points)
        lines.append(f'<polyline stroke="{_colour(s.colour)}" stroke-width="{s.width}" points="{line}"/>')
    return "\n".join([*lines, "</g>", "</svg>", ""])


def _colour(colour: int) -> str:
    return f"#{colour >> 8:06x}"
