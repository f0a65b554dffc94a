"""Build water: hydrogen that comes near the oxygen sticks to it. Carry the white balls to the red one.

vistel up conference.toml
python examples/activities/molecule.py --as aiko
"""

from vistel.session.activity import run
from vistel.session.session import AsyncSession

NEAR = 0.08
"""From centre to centre [m]."""


async def build_water(session: AsyncSession) -> None:
    """Two hydrogen atoms stick to an oxygen atom when they are brought near it."""
    (oxygen,) = (await session.ask("create red ball 8 cm here")).things
    free = [(await session.ask("create white ball 5 cm here")).things[0] for _ in range(2)]
    async for room in session.steps():
        for hydrogen in [h for h in free if room.apart(h, oxygen) < NEAR]:
            if (await session.ask(f"attach {oxygen} to {hydrogen}")).done:
                free.remove(hydrogen)
        if not free:
            print("water")
            return


if __name__ == "__main__":
    run(build_water)
