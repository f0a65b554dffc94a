"""Open a recorded conference and see what is in it.

make demo                                          (writes out/latest/conference.mcap)
python examples/01_open_a_log.py out/latest/conference.mcap
"""

import sys
from collections import Counter

import vistel.log


def main(path: str) -> None:
    """Print who took part, and how many messages of each topic there are."""
    log = vistel.log.open(path)
    print(f"{log.path}: {log.duration:.1f} s, {', '.join(log.participants)}")
    count = Counter(message.topic for message in log.messages())
    for topic, number in count.most_common():
        print(f"{topic:20} {number:6}  {number / max(log.duration, 1e-9):7.1f} per second")
    for line in log.damage:
        print(f"damaged: {line}")


if __name__ == "__main__":
    main(sys.argv[1])
