"""A puzzle for everybody: put each thing on its place; what lies there turns green, and all five in place is solved.

vistel up conference.toml
python examples/activities/puzzle.py --as aiko
"""

import math

import numpy as np

from vistel.session.activity import run
from vistel.session.session import AsyncSession

PLACES = {"box": (0.2, 0.0), "can": (-0.2, 0.1), "ring": (0.0, 0.25), "cone": (0.05, -0.3), "tile": (-0.25, -0.15)}
"""Where each thing belongs on the table: x and z [m]."""
NEAR = 0.04


async def puzzle(session: AsyncSession) -> None:
    """Things that lie on their places turn green."""
    solved: set[str] = set()
    async for room in session.steps(every_s=0.25):
        for thing, (x, z) in PLACES.items():
            here = room.things[thing].position if thing in room.things else np.full(3, math.inf)
            lies = math.hypot(here[0] - x, here[2] - z) < NEAR and not room.things[thing].holders
            if lies and thing not in solved and (await session.ask(f"paint {thing} green")).done:
                solved.add(thing)
            elif not lies and thing in solved and (await session.ask(f"paint {thing} grey")).done:
                solved.discard(thing)
        if len(solved) == len(PLACES):
            print("solved")
            return


if __name__ == "__main__":
    run(puzzle)
