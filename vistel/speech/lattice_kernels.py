"""One frame of the search: tokens move along every word of the automaton and round the garbage loop.

Positions are the states of all words, word after word. A token carries its score and the time it entered its word; what
came before is found through the links kept for every junction and time (`decoder.py`).
"""

import numpy as np

from vistel.arrays import F32, I32
from vistel.jit.kernel_jit import compiled

LINKS = 6
"""Words kept for each junction and time: the best of those that end there."""
NEVER = np.float32(-1e30)


@compiled
def advance(
    state: I32,
    stay: F32,
    move: F32,
    first: I32,
    source: I32,
    cost: F32,
    now: F32,
    before: F32,
    score: F32,
    entered: I32,
    top: F32,
    beam: float,
    best: float,
    time: int,
) -> None:
    """Moves the tokens of every word (first[w] to first[w + 1] - 1) by one frame.

    state, stay, move: of each position; cost: of entering each word; now: (STATES,) scores of the frame;
    before: (junctions,) at the last time; score, entered: tokens, changed in place; top: (words,) the best score in each
    word; best: of all at the last time.
    """
    least = best - beam
    for w in range(len(first) - 1):
        a, b = first[w], first[w + 1]
        if a == b:
            continue
        entry = before[source[w]] - cost[w]
        if top[w] < least and entry < least:
            if top[w] > NEVER:
                for p in range(a, b):
                    score[p] = NEVER
                top[w] = NEVER
            continue
        highest = NEVER
        for p in range(b - 1, a - 1, -1):
            kept = score[p] + stay[p]
            if p > a:
                come, since = score[p - 1] + move[p - 1], entered[p - 1]
            else:
                come, since = entry, time - 1
            if come > kept:
                kept = come
                entered[p] = since
            score[p] = max(kept + now[state[p]], NEVER)
            highest = max(highest, score[p])
        top[w] = highest


@compiled
def arrive(
    move: F32,
    first: I32,
    source: I32,
    order: I32,
    order_first: I32,
    score: F32,
    entered: I32,
    beam: float,
    best: float,
    time: int,
    junction: F32,
    link_word: I32,
    link_entered: I32,
    link_score: F32,
    link_count: I32,
) -> None:
    """Scores of the junctions at this time, in rising order, and the words that led there.

    order: words by the junction they lead to, order_first: where those of each junction begin. junction: (junctions,)
    out; link_*: (junctions, LINKS) out, best first; link_count: (junctions,) out.
    """
    least = best - beam
    for j in range(len(junction)):
        count = 0
        for k in range(order_first[j], order_first[j + 1]):
            w = order[k]
            a, b = first[w], first[w + 1]
            if a == b:
                value, since = junction[source[w]], time
            else:
                value, since = score[b - 1] + move[b - 1], entered[b - 1]
            if value < least or value <= NEVER:
                continue
            at = min(count, LINKS)
            while at > 0 and link_score[j, at - 1] < value:
                if at < LINKS:
                    link_word[j, at] = link_word[j, at - 1]
                    link_entered[j, at] = link_entered[j, at - 1]
                    link_score[j, at] = link_score[j, at - 1]
                at -= 1
            if at < LINKS:
                link_word[j, at], link_entered[j, at], link_score[j, at] = w, since, value
                count = min(count + 1, LINKS)
        link_count[j] = count
        junction[j] = link_score[j, 0] if count > 0 else NEVER


@compiled
def round_the_loop(now: F32, stay: F32, move: F32, penalty: float, score: F32, entry: float) -> float:
    """The garbage loop over all phones by one frame: `score` (STATES,) in place; returns what leaves any phone.

    State 0 is the pause, 2 p - 1 and 2 p are phone p. entry: what left at the last time.
    """
    score[0] = max(score[0] + stay[0], entry) + now[0]
    out = float(score[0] + move[0])
    for s in range(1, len(score), 2):
        kept = score[s + 1] + stay[s + 1]
        come = score[s] + move[s]
        score[s + 1] = max(kept, come) + now[s + 1]
        score[s] = max(score[s] + stay[s], entry - penalty) + now[s]
        out = max(out, float(score[s + 1] + move[s + 1]))
    return out
