"""Watch a running conference: whose hand is where, and who holds what.

vistel up conference.toml --seconds 600          (prints the address of its router)
python examples/10_watch_a_conference.py conference.toml tcp/127.0.0.1:7447 5
"""

import sys

import vistel


def main(conference: str, hub: str, seconds: float) -> None:
    """Print the things that are held, twice a second."""
    with vistel.join(conference, hub=hub) as session:
        begin_ns = None
        for room in session.steps(every_s=0.5):
            begin_ns = begin_ns or room.t_ns
            held = [f"{t.name} by {', '.join(t.holders)}" for t in room.things.values() if t.holders]
            print(f"step {room.step}: {len(room.people)} people; {'; '.join(held) or 'nothing is held'}")
            if room.t_ns - begin_ns > seconds * 1e9:
                return


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
