"""How long calls take, measured in turn so that what else runs on the machine meets all of them."""

import time
from collections.abc import Callable
from statistics import median


def microseconds(calls: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Median processor time of this thread in each call, all in turn, in the order given."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for call in calls.values():
        call()
    for _ in range(rounds):
        for name, call in calls.items():
            begin = time.thread_time_ns()
            call()
            times[name].append(1e-3 * (time.thread_time_ns() - begin))
    return {name: median(values) for name, values in times.items()}
