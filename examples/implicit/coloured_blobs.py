"""Blend coloured shapes and look at what comes out: python examples/implicit/coloured_blobs.py"""

import numpy as np

import vistel.implicit as vi

upper = vi.ConeSphere.of_surface((0, 0, 0), (0.3, 0, 0), 0.055, 0.042).with_attributes(colour=(0.9, 0.6, 0.5))
lower = vi.ConeSphere.of_surface((0.3, 0, 0), (0.45, 0.2, 0), 0.043, 0.028).with_attributes(colour=(0.5, 0.6, 0.9))
table = vi.Pointblob.of_surface(vi.box((0.4, 0.02, 0.3), (0.3, -0.2, 0)), (0.3, -0.2, 0))

arm = upper + lower  # these two melt together at the elbow
scene = arm | table.with_attributes(colour=(0.4, 0.3, 0.2))  # the table stays apart

program = vi.compile(scene)
print(program)

elbow = np.array([[0.3, 0.05, 0.0], [0.3, 0.03, 0.0], [0.2, 0.0, 0.0]])
found = program.evaluate(elbow, gradient=True, attributes=True)
for point, field, colour in zip(elbow, found.field, found.attributes["colour"], strict=True):
    print(f"at {point}: F = {field:.3f}, {'inside' if field >= vi.THRESHOLD else 'outside'}, colour {np.round(colour, 2)}")

low, high = program.bounds
lattice = program.grid(low, high, 96)
cell = np.prod((high - low) / 95)
print(f"volume {1e3 * cell * (lattice >= vi.THRESHOLD).sum():.2f} litres")
