"""Blend coloured shapes, and look at the field that comes out.

python examples/07_blend_a_field.py
"""

import numpy as np

import vistel.implicit as vi


def main() -> None:
    """An arm whose two halves melt together at the elbow, on a table that stays apart."""
    upper = vi.ConeSphere.of_surface((0, 0, 0), (0.3, 0, 0), 0.055, 0.042).with_attributes(colour=(0.9, 0.6, 0.5))
    lower = vi.ConeSphere.of_surface((0.3, 0, 0), (0.45, 0.2, 0), 0.043, 0.028).with_attributes(colour=(0.5, 0.6, 0.9))
    table = vi.Pointblob.of_surface(vi.box((0.4, 0.02, 0.3), (0.3, -0.2, 0)), (0.3, -0.2, 0))
    program = vi.compile((upper + lower) | table.with_attributes(colour=(0.4, 0.3, 0.2)))

    points = np.array([[0.3, 0.05, 0.0], [0.3, 0.03, 0.0], [0.2, 0.0, 0.0]])
    found = program.evaluate(points, gradient=True, attributes=True)
    for point, field, colour in zip(points, found.field, found.attributes["colour"], strict=True):
        side = "inside" if field >= vi.THRESHOLD else "outside"
        print(f"at {point}: F = {field:.3f}, {side}, colour {np.round(colour, 2)}")

    low, high = program.bounds
    lattice = program.grid(low, high, 96)
    litres = 1e3 * float(np.prod((high - low) / 95)) * int((lattice >= vi.THRESHOLD).sum())
    print(f"volume {litres:.2f} litres")


if __name__ == "__main__":
    main()
