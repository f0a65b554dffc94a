"""The likeliest sentences of an automaton for a stream of frames (Viterbi, token passing). A loop over all phones beside it stands
for any other speech."""

import heapq
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, I32
from vistel.speech.acoustic import AcousticModel
from vistel.speech.automaton import Automaton
from vistel.speech.lattice_kernels import LINKS, NEVER, advance, arrive, round_the_loop

_PAUSE = -2
"""Word of the arc that waits at a junction."""
_EXPANSIONS = 4000


@dataclass(frozen=True)
class Network:
    """An automaton as states: every word's phones written out, and at every junction a pause that may be taken.

    first: (words + 1,) where each arc's positions begin; state, stay, move: of each position (logarithms); source, target, word: of
    each arc; word is an index into `words`, -1 for none, -2 for a pause. cost: of entering it. order, order_first: arcs by target.
    """

    words: tuple[str, ...]
    junctions: int
    source: I32
    target: I32
    word: I32
    cost: F32
    first: I32
    state: I32
    stay: F32
    move: F32
    order: I32
    order_first: I32
    loop_stay: F32
    loop_move: F32


def network(automaton: Automaton, model: AcousticModel, word_cost: float = 0.0) -> Network:
    """word_cost: penalty of every word [log], so that noise does not become words.

    Raises ValueError where the automaton was compiled for other phones than the model's.
    """
    if automaton.phones != model.phones:
        raise ValueError("speech: the grammar was compiled for other phones than the acoustic model has")
    waits = np.arange(automaton.junctions, dtype=np.int32)
    source = np.concatenate([automaton.arc_from, waits])
    target = np.concatenate([automaton.arc_to, waits])
    word = np.concatenate([automaton.arc_word, np.full(len(waits), _PAUSE, np.int32)])
    states: list[int] = []
    first = [0]
    for arc in range(automaton.arcs):
        for phone in automaton.arc_phones[automaton.arc_start[arc] : automaton.arc_start[arc + 1]].tolist():
            states.extend([0] if phone == 0 else [2 * phone - 1, 2 * phone])
        first.append(len(states))
    for _ in waits:
        states.append(0)
        first.append(len(states))
    state = np.array(states, np.int32)
    cost = np.where((word != _PAUSE) & (np.diff(first) > 0), word_cost, 0.0).astype(np.float32)
    stay, move = np.log(model.stay), np.log1p(-model.stay)
    order = np.lexsort((source, target)).astype(np.int32)
    order_first = np.searchsorted(target[order], np.arange(automaton.junctions + 1)).astype(np.int32)
    return Network(
        automaton.words,
        automaton.junctions,
        source,
        target,
        word,
        cost,
        np.array(first, np.int32),
        state,
        stay[state],
        move[state],
        order,
        order_first,
        stay,
        move,
    )


@dataclass(frozen=True)
class DecodedSentence:
    """score: of all frames; words: names; bounds: (begin, end) frame of each word, the end not of it; word_scores: what
    each adds to the score; states: how many of them the words have."""

    score: float
    words: tuple[str, ...]
    bounds: tuple[tuple[int, int], ...]
    word_scores: tuple[float, ...]
    states: int


_Step = tuple[int, int, int, float, int]
"""Of a path: word, begin, end, score, states."""


class SpeechDecoder:
    """One utterance, from its first frame on. `beam`: how far behind the best a token may fall [log]."""

    def __init__(self, network: Network, beam: float = 150.0, loop_penalty: float = 2.0) -> None:
        self._net = network
        self._beam = beam
        self._penalty = loop_penalty
        net = network
        self._score = np.full(len(net.state), NEVER, np.float32)
        self._entered = np.zeros(len(net.state), np.int32)
        self._top = np.full(len(net.source), NEVER, np.float32)
        self._junction = np.full(net.junctions, NEVER, np.float32)
        self._junction[0] = 0.0
        self._loop = np.full(len(net.loop_stay), NEVER, np.float32)
        self._loop_out = 0.0
        self._best = 0.0
        self.time = 0
        self._kept = [self._links()]
        self._silent_steps(self._kept[0])
        self.garbage: list[float] = [0.0]

    def _links(self) -> tuple[I32, I32, F32, I32, F32]:
        shape = (self._net.junctions, LINKS)
        ints = np.zeros((2, *shape), np.int32)
        return ints[0], ints[1], np.zeros(shape, np.float32), np.zeros(shape[0], np.int32), self._junction

    def _silent_steps(self, kept: tuple[I32, I32, F32, I32, F32]) -> None:
        """At time 0: junctions that are reached without a sound."""
        net = self._net
        for k in net.order:
            if net.first[k] == net.first[k + 1] and self._junction[net.source[k]] > NEVER:
                at, count = net.target[k], kept[3][net.target[k]]
                self._junction[at] = self._junction[net.source[k]]
                if count < LINKS:
                    kept[0][at, count], kept[1][at, count], kept[2][at, count] = k, 0, 0.0
                    kept[3][at] = count + 1

    def feed(self, frame: F32) -> None:
        """The next frame: (STATES,) logarithms of how well each state fits."""
        net = self._net
        self.time += 1
        advance(
            net.state,
            net.stay,
            net.move,
            net.first,
            net.source,
            net.cost,
            frame,
            self._junction,
            self._score,
            self._entered,
            self._top,
            self._beam,
            self._best,
            self.time,
        )
        self._best = float(self._top.max())
        self._junction = np.empty(net.junctions, np.float32)
        kept = self._links()
        arrive(
            net.move,
            net.first,
            net.source,
            net.order,
            net.order_first,
            self._score,
            self._entered,
            self._beam,
            self._best,
            self.time,
            self._junction,
            *kept[:4],
        )
        self._kept.append(kept)
        self._loop_out = round_the_loop(frame, net.loop_stay, net.loop_move, self._penalty, self._loop, self._loop_out)
        self.garbage.append(float(self._loop.max()))

    @property
    def behind(self) -> float:
        """How far the best whole sentence is behind the best token of all [log]; infinite while there is none."""
        whole = float(self._junction[-1])
        return self._best - whole if whole > NEVER else float("inf")

    def sentences(self, most: int = 5) -> list[DecodedSentence]:
        """The likeliest whole sentences with different words, best first; none where none fits.

        Exact where the best boundary between two words does not depend on the words before them.
        """
        end, last = self._net.junctions - 1, self.time
        if self._kept[last][3][end] == 0:
            return []
        net = self._net
        start = float(self._kept[last][4][end])
        heap: list[tuple[float, int, float, int, int, tuple[_Step, ...]]] = [(-start, 0, 0.0, end, last, ())]
        found: dict[tuple[int, ...], DecodedSentence] = {}
        seen: set[tuple[int, int, tuple[int, ...]]] = set()
        pushed = 1
        while heap and len(found) < most and pushed < _EXPANSIONS:
            cost, _, tail, junction, time, path = heapq.heappop(heap)
            words = tuple(step[0] for step in path)
            if (junction, time, words) in seen:
                continue
            seen.add((junction, time, words))
            if junction == 0 and time == 0:
                bounds = tuple((step[1], step[2]) for step in path)
                names, scores = tuple(net.words[w] for w in words), tuple(step[3] for step in path)
                found[words] = DecodedSentence(-cost, names, bounds, scores, sum(step[4] for step in path))
                continue
            word, entered, score, count, _ = self._kept[time]
            for k in range(count[junction]):
                arc, since = int(word[junction, k]), int(entered[junction, k])
                total = tail + float(score[junction, k])
                source = int(net.source[arc])
                before = float(self._kept[since][4][source])
                size = int(net.first[arc + 1] - net.first[arc])
                step = (int(net.word[arc]), since, time, float(score[junction, k]) - before, size)
                rest = (step, *path) if step[0] >= 0 else path
                heapq.heappush(heap, (-total, pushed, total - before, source, since, rest))
                pushed += 1
        return list(found.values())
