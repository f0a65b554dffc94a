"""Who held a thing, from when to when, and how far it was carried.

python examples/03_follow_a_thing.py out/latest/conference.mcap baton
"""

import sys

import numpy as np

import vistel.log


def main(path: str, thing: str) -> None:
    """Print a line whenever the holders of a thing change."""
    holders: tuple[str, ...] = ()
    place, carried = None, 0.0
    for t, room in vistel.log.open(path).rooms():
        view = room.things.get(thing)
        if view is None:
            continue
        if place is not None and view.holders:
            carried += float(np.linalg.norm(view.position - place))
        place = view.position
        if view.holders != holders:
            holders = view.holders
            print(f"{t:7.2f} s  {thing} is held by {', '.join(holders) or 'nobody'}")
    print(f"{thing} was carried {carried:.2f} m")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
