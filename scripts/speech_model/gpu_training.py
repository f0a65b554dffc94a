"""Trains the net on a GPU, where PyTorch is there: on far more speech than `training.py` has time for, beside a larger net.

The larger net sees more before and after a frame than may be waited for in a conversation. Both learn the states; the smaller one
also learns how likely the larger one takes each state to be, which says more than the one right state does.
"""

import importlib
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scripts.speech_model.training import Frames
from vistel.arrays import F32
from vistel.speech.acoustic import AcousticModel
from vistel.speech.features import BANDS

_BATCH = 4096
_PACE, _LARGER_PACE = 1.5e-3, 5e-4
_LEAST_PACE = 1e-3
"""Share of the pace that is left at the end."""
_MOST_PACE = 500
"""Steps until which the pace rises."""
_LARGER_OFFSETS = (*range(-48, -16, 4), *range(-16, 17, 2), *range(20, 40, 4))
_LARGER_HIDDEN = (2048, 2048, 2048, 2048)
_FROM_LARGER = 0.6
"""Share of the smaller net's loss that is its distance from the larger one's probabilities."""
_DROPPED = 0.1
"""Share of the larger net's values that are left out at each step, so that it does not learn the speech by heart."""
_DECAY = 1e-2
"""Of the larger net's weights."""


def train(
    random: np.random.Generator,
    model: AcousticModel,
    rounds: Iterable[Frames],
    done: Callable[[int], float],
    passes: int,
    tell: Callable[[str], None],
) -> AcousticModel:
    """The model after the rounds, all frames of each learnt from `passes` times, each time warped otherwise.

    done: which share of the work is behind after so many rounds, 0 to 1; `tell` hears how it goes.
    """
    torch: Any = importlib.import_module("torch")
    torch.manual_seed(int(random.integers(2**31)))
    nets = _Nets(torch, model)
    began, step = time.monotonic(), 0
    for number, frames in enumerate(rounds):
        values, states, known = (
            torch.from_numpy(each).cuda() for each in (frames.values * model.scale, frames.states.astype(np.int64), frames.known)
        )
        told: list[Any] = []
        for _ in range(passes):
            order = known[torch.randperm(len(known), device="cuda")]
            for at in order[: len(order) // _BATCH * _BATCH].split(_BATCH):
                step += 1
                fall = 0.5 + 0.5 * float(np.cos(np.pi * min(1.0, done(number))))
                nets.pace(max(_LEAST_PACE, fall) * min(1.0, step / _MOST_PACE))
                told.append(nets.learn(values, at, states[at], _Manner.drawn(torch, random)))
        loss, loss_larger, right, right_larger = torch.stack(told).mean(0).tolist()
        spent = (time.monotonic() - began) / 60.0
        of_larger = f"the larger net {loss_larger:.4f}, {100.0 * right_larger:.1f} %"
        tell(f"round {number + 1}, {spent:.2f} min: loss {loss:.4f}, {100.0 * right:.1f} % right; {of_larger}")
    return nets.smaller_as(model)


@dataclass(frozen=True)
class _Manner:
    """How all frames of a step are changed.

    warp: (BANDS, BANDS) bands to bands; tilt: (BANDS,) added; mask: (BANDS,) 0 where the smaller net sees nothing, so that no
    narrow noise can hide what is said; tempo: times as slow.
    """

    warp: Any
    tilt: Any
    mask: Any
    tempo: float

    @staticmethod
    def drawn(torch: Any, random: np.random.Generator) -> "_Manner":
        knots, bands = np.linspace(0.0, BANDS - 1.0, 5), np.arange(BANDS)
        places = bands * random.uniform(0.93, 1.08) + np.interp(bands, knots, random.normal(0.0, 0.5, 5))
        at = np.clip(places, 0.0, BANDS - 1.001)
        low = at.astype(int)
        warp = np.zeros((BANDS, BANDS), np.float32)
        warp[low, bands] = 1.0 - (at - low)
        warp[low + 1, bands] = at - low
        tilt = np.interp(bands, knots, random.normal(0.0, 0.15, 5)).astype(np.float32)
        mask = np.ones(BANDS, np.float32)
        if random.random() < 0.5:
            size = int(random.integers(1, 7))
            first = int(random.integers(BANDS - size + 1))
            mask[first : first + size] = 0.0
        on_gpu = (torch.from_numpy(each).cuda() for each in (warp, tilt, mask))
        return _Manner(*on_gpu, float(random.uniform(0.9, 1.1)))


class _Nets:
    """Both nets and their optimisers, on the GPU."""

    def __init__(self, torch: Any, model: AcousticModel) -> None:
        self._torch = torch
        self._smaller = _net(torch, [*(w.shape[0] for w in model.weights), model.states], 0.0)
        with torch.no_grad():
            for layer, weight, bias in zip(self._layers(), model.weights, model.biases, strict=True):
                layer.weight.copy_(torch.from_numpy(np.ascontiguousarray(weight.T)))
                layer.bias.copy_(torch.from_numpy(bias))
        self._larger = _net(torch, [len(_LARGER_OFFSETS) * BANDS, *_LARGER_HIDDEN, model.states], _DROPPED)
        self._near = torch.tensor(model.offsets, device="cuda")
        self._far = torch.tensor(_LARGER_OFFSETS, device="cuda")
        groups = [
            {"params": list(self._smaller.parameters()), "weight_decay": 0.0, "full": _PACE},
            {"params": list(self._larger.parameters()), "weight_decay": _DECAY, "full": _LARGER_PACE},
        ]
        self._optimiser = torch.optim.AdamW(groups, lr=_PACE, betas=(0.9, 0.99), fused=True)

    def pace(self, share: float) -> None:
        """How long the next step is, as a share of the longest."""
        for group in self._optimiser.param_groups:
            group["lr"] = group["full"] * share

    def learn(self, values: Any, at: Any, states: Any, manner: _Manner) -> Any:
        """One step; (4,) losses of both nets, and shares of the frames that they had right."""
        torch, f = self._torch, self._torch.nn.functional
        with torch.autocast("cuda", dtype=torch.bfloat16):
            larger = self._larger(_windows(torch, values, at, self._far, manner).flatten(1)).float()
            smaller = self._smaller((_windows(torch, values, at, self._near, manner) * manner.mask).flatten(1)).float()
        right, right_larger = f.cross_entropy(smaller, states), f.cross_entropy(larger, states)
        likely = f.softmax(larger.detach(), 1)
        apart = -(likely * f.log_softmax(smaller, 1)).sum(1).mean()
        self._optimiser.zero_grad(set_to_none=True)
        ((1.0 - _FROM_LARGER) * right + _FROM_LARGER * apart + right_larger).backward()
        self._optimiser.step()
        hits = [(scores.argmax(1) == states).float().mean() for scores in (smaller, larger)]
        return torch.stack([right.detach(), right_larger.detach(), *hits])

    def smaller_as(self, model: AcousticModel) -> AcousticModel:
        """The model with the weights of the smaller net."""
        weights: list[F32] = [np.ascontiguousarray(layer.weight.detach().cpu().numpy().T) for layer in self._layers()]
        return replace(model, weights=tuple(weights), biases=tuple(layer.bias.detach().cpu().numpy() for layer in self._layers()))

    def _layers(self) -> list[Any]:
        return list(self._smaller)[::2]


def _windows(torch: Any, values: Any, at: Any, offsets: Any, manner: _Manner) -> Any:
    """(n, window, BANDS) what is round each frame, in a manner."""
    where = (at[:, None] + torch.round(offsets * manner.tempo).long()[None]).clamp(0, len(values) - 1)
    return values[where] @ manner.warp + manner.tilt


def _net(torch: Any, widths: list[int], dropped: float) -> Any:
    """Layers with a rectifier after each but the last, and after it, where `dropped` is above 0, what leaves values out."""
    layers: list[Any] = []
    for k in range(len(widths) - 1):
        layers.append(torch.nn.Linear(widths[k], widths[k + 1]))
        if k < len(widths) - 2:
            layers.append(torch.nn.ReLU())
            if dropped > 0.0:
                layers.append(torch.nn.Dropout(dropped))
    return torch.nn.Sequential(*layers).cuda()
