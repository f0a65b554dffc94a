"""Fire the clay: when nobody has touched it for ten seconds it is hard and brown; until then everybody may shape it.

vistel up examples/conferences/clay.toml
python examples/activities/kiln.py --as aiko
"""

from vistel.session.activity import run
from vistel.session.session import AsyncSession

REST_S = 10.0


async def kiln(session: AsyncSession, lump: str = "clay") -> None:
    """A lump that has been left alone is fired."""
    touched_ns = 0
    async for room in session.steps():
        if room.touched(lump) or not touched_ns:
            touched_ns = room.t_ns
        if room.t_ns - touched_ns > REST_S * 1e9:
            await session.ask(f"harden {lump}")
            await session.ask(f"paint {lump} brown")
            print("fired")
            return


if __name__ == "__main__":
    run(kiln)
