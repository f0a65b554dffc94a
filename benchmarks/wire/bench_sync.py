"""A person claps: how far the sound at another site is from its picture, over links with delay, jitter and loss."""

from collections.abc import Iterator

import numpy as np

from benchmarks.row import Row, at_most
from benchmarks.wire.sync_conference import FOR_LOSSES, PLAIN, NetworkLink, Sending, clapping
from vistel.audio.delay_policy import Policy

CLAPS, CLAPS_FIXED = 50, 8
JITTER_S, LOSS = 0.050, 0.05
EARLY_MS, LATE_MS = 15.0, 45.0
"""How much sound may be before and after its picture (ATSC IS-191)."""
SINGH = "fixed 0.2 s (Singh 1995)"


def run() -> Iterator[Row]:
    links = [(delay_s, LOSS, FOR_LOSSES) for delay_s in (0.0, 0.040, 0.120)] + [(0.040, 0.0, PLAIN), (0.040, LOSS, PLAIN)]
    for number, (delay_s, loss, sending) in enumerate(links):
        link = NetworkLink(delay_s, JITTER_S, loss)
        skew, ear, picture, missed = _measured(link, Policy(), CLAPS, 10 + number, sending)
        fixed, fixed_ear, _, _ = _measured(link, Policy(0.2), CLAPS_FIXED, 20 + number, sending)
        case = f"{1e3 * delay_s:.0f} ms one way, {1e3 * JITTER_S:.0f} ms jitter, {100 * loss:.0f} % loss"
        case += ", each message once" if sending == PLAIN else ""
        wanted = loss == 0.0 or sending == FOR_LOSSES  # who sends each message once on a lossy link has been told
        figures = [
            ("skew, median", np.median(np.abs(skew)), np.median(np.abs(fixed)), 5.0),
            ("sound before picture, p99", np.percentile(-skew, 99), np.percentile(-fixed, 99), EARLY_MS),
            ("sound after picture, p99", np.percentile(skew, 99), np.percentile(fixed, 99), LATE_MS),
            ("mouth to ear, beyond the picture", np.median(ear) - np.median(picture), None, 20.0),
            ("mouth to ear, median", np.median(ear), np.median(fixed_ear), None),
            ("capture to picture, median", np.median(picture), None, None),
            ("claps not heard or seen", missed, None, 0.0),
        ]
        for metric, value, peer, limit in figures:
            unit = "claps" if "claps" in metric else "ms"
            target = None if limit is None or not wanted else at_most(limit)
            named = SINGH if peer is not None else None
            theirs = None if peer is None else float(peer)
            yield Row("sync", case, metric, unit, float(value), named, theirs, target=target)


def _measured(
    link: NetworkLink, policy: Policy, claps: int, seed: int, sending: Sending
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Ear after picture, capture to ear, capture to picture [ms]; claps that were missed."""
    meetings = clapping(link, policy, claps, seed, sending)
    rows = np.array([(m.done_s, m.seen_s, m.heard_s) for m in meetings])
    good = np.isfinite(rows).all(1)
    done, seen, heard = 1e3 * rows[good].T
    return heard - seen, heard - done, seen - done, int(np.count_nonzero(~good))
