"""The session of one page: its own copy of the avatar's wrinkles and registrations. One thread computes for all."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import U8
from vistel.figure.avatar.avatar import Avatar
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.instance import Instance
from vistel.wrinkle.region import builtin_regions, sides_of, tube
from vistel.wrinkle.worn import REFERENCE_HEIGHT, Worn, WornSet
from vistel.wrinkle.wrinkle_sets import WrinkleSet
from vistel_cli.studio.wrinkles.bends import strongest, values_of
from vistel_cli.studio.wrinkles.document import CheckedSets, SetFault, check
from vistel_cli.studio.wrinkles.figure_scene import DrawnFigure, FigureScene
from vistel_cli.studio.wrinkles.photograph import PictureError, laid_out, lying, photographed, texture_of

BATCH = 4
"""Number of sets up to which no progress is shown."""

Answer = tuple[dict[str, Any], dict[str, NDArray[Any]]]


@dataclass
class PageSession:
    """scene: the avatar with the page's registrations; checked, worn: from the last form; version: number of the light that
    the page has, from 1."""

    scene: FigureScene
    checked: CheckedSets
    worn: Worn
    say: Callable[[str], None]
    version: int = 0
    light: U8 | None = None
    left_out: list[SetFault] = field(default_factory=list[SetFault])
    bases: list[Avatar] = field(default_factory=list[Avatar])
    """The avatar as it was opened, then with each photograph that the page brought."""
    base: int = 0
    _laid_out: tuple[Avatar, Answer] | None = None

    def __post_init__(self) -> None:
        self.bases = [self.scene.avatar]

    def lay(self) -> None:
        """Wear the checked sets. Sets that leave the region of this avatar are left out, with a fault."""
        whole = [self.checked.sets[k] for k in sorted(self.checked.sets)]
        known = {id(s.what) for s in self.worn.sets}
        usable, new = [s for s in whole if id(s) in known], [s for s in whole if id(s) not in known]
        self.left_out = []
        for start in range(0, len(new), BATCH):
            if len(new) > BATCH:
                self.say(f"laying wrinkles, {start} of {len(new)} sets")
            usable = self._with(usable, new[start : start + BATCH])
        kept = {id(s) for s in usable}
        self.worn = self.worn.wearing([s for s in whole if id(s) in kept])

    def wear(self, form: Mapping[str, Any]) -> list[SetFault]:
        """Wears the sets of a form, or changes nothing and returns its faults."""
        before = self.checked, self.worn, self.left_out
        known = {fault.set for fault in self.left_out}
        checked = check(form, self.checked)
        if checked.faults:
            return list(checked.faults)
        self.checked = checked
        self.lay()
        new = [fault for fault in self.left_out if fault.set not in known]
        if new:
            self.checked, self.worn, self.left_out = before
        return new

    def _with(self, usable: list[WrinkleSet], new: list[WrinkleSet]) -> list[WrinkleSet]:
        try:
            self.worn = self.worn.wearing([*usable, *new])
        except WrinkleError as fault:
            if len(new) == 1:
                number = next(k for k, s in self.checked.sets.items() if s is new[0])
                self.left_out += [SetFault(line, number) for line in str(fault).splitlines()]
                return usable
            for each in new:
                usable = self._with(usable, [each])
            return usable
        return [*usable, *new]

    def update(self, asked: Mapping[str, Any]) -> Answer:
        """The page's changes after a request: `form` (or none: as before), `bends`, `held`, `plane`, `seek`, `have`. A form with
        faults changes nothing."""
        anew, faults = bool(asked.get("whole")), list[SetFault]()
        if asked.get("form") is not None:
            form = _table(asked["form"])
            anew = self.retexture(form) or anew
            faults = self.wear(form)
        values = values_of(_table(asked.get("bends")))
        numbers = {id(s): k for k, s in self.checked.sets.items()}
        found = self._seek(asked.get("seek"), values)
        values |= found
        held = frozenset(str(name) for name in _list(asked.get("held")))
        seen = self.scene.seen(self.worn, values, held)
        head: dict[str, Any] = {
            "faults": [vars(fault) for fault in dict.fromkeys((*faults, *self.left_out, *self._unfit()))],
            "bends": values,
            "sets": [
                {"set": numbers[id(s.what)], "side": s.side, "weight": round(w, 4), "driven": round(d, 4)}
                for s, w, d in zip(self.worn.sets, seen.weights.tolist(), seen.driven, strict=True)
            ],
        }
        arrays: dict[str, NDArray[Any]] = {"positions": seen.positions, "normals": seen.normals, "uv": seen.uv}
        self._lit(seen, int(asked.get("have") or 0), head, arrays)
        self._plane(_table(asked.get("plane")), head, arrays)
        if (of := self._worn_set(_table(asked.get("focus")))) is not None:
            head["focus"] = self.scene.focus(self.worn, of, seen)
        if asked.get("form") is not None:
            head["jitters"] = self._jitters()
        if anew:
            head["albedo"] = list(self.scene.albedo.shape[1::-1])
            arrays |= {"triangles": self.scene.triangles, "still": self.scene.uv}
        return head, arrays

    def photograph(self, asked: Mapping[str, Any]) -> Answer:
        """Data to register the texture: the figure in its posture, and its islands."""
        made = self._lying(_table(asked.get("form")))
        if self._laid_out is None or self._laid_out[0] is not made:
            self._laid_out = made, laid_out(made)
        head, arrays = self._laid_out[1]
        return head, arrays | self.scene.undressed(values_of(_table(asked.get("bends"))))

    def bring(self, island: int, data: bytes) -> dict[str, Any]:
        """A photograph for an island of the newest avatar. Raises PictureError."""
        self.say("laying the photograph")
        made, notes = photographed(self.bases[self.base], island, data)
        self.bases = [*self.bases[: self.base + 1], made]
        self.base += 1
        return {"base": self.base, "notes": notes}

    def texture(self, asked: Mapping[str, str]) -> U8:
        """(H, W, 3) the picture that lies on the islands."""
        return self.bases[self._number(asked)].albedo

    def _number(self, form: Mapping[str, Any]) -> int:
        try:
            number = int(form.get("base") or 0)
        except ValueError:
            number = -1
        if not 0 <= number < len(self.bases):
            raise PictureError(f"photograph {number} is not there; bring it again")
        return number

    def _lying(self, form: Mapping[str, Any]) -> Avatar:
        self.base = self._number(form)
        of, texture = self.bases[self.base], form.get("texture")
        if texture is None or texture_of(of) == texture:
            return of
        return self.scene.avatar if self._lies_so(of, texture) else lying(of, _list(texture))

    def _lies_so(self, of: Avatar, texture: Any) -> bool:
        """Whether the scene's avatar is that one with that texture."""
        return self.scene.avatar.albedo is of.albedo and texture_of(self.scene.avatar) == texture

    def retexture(self, form: Mapping[str, Any]) -> bool:
        """Registers the texture as in the form. Returns whether it changed; a change takes some seconds."""
        made = self._lying(form)
        if texture_of(made) == texture_of(self.scene.avatar) and made.albedo is self.scene.avatar.albedo:
            return False
        self.say("laying the texture")
        self.scene = FigureScene(made, self.say, self.scene)
        self.worn, self.light = self.scene.bare, None
        self.lay()
        return True

    def _lit(self, seen: DrawnFigure, have: int, head: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> None:
        """Adds the changed part of the light, or all of it if the page does not have the previous one."""
        light = self.scene.light(self.worn, seen.weights)
        row, column, rows, columns = 0, 0, *light.shape
        if self.light is not None and self.light.shape == light.shape and have == self.version:
            changed = light != self.light
            at_rows, at_columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
            if len(at_rows) == 0:
                head["light"] = {"version": self.version}
                return
            row, column = int(at_rows[0]), int(at_columns[0])
            rows, columns = int(at_rows[-1]) - row + 1, int(at_columns[-1]) - column + 1
        self.light, self.version = light, self.version + 1
        head["light"] = {"version": self.version, "size": light.shape[::-1], "rect": [column, row, columns, rows]}
        arrays["light"] = np.ascontiguousarray(light[row : row + rows, column : column + columns])

    def _plane(self, asked: Mapping[str, Any], head: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> None:
        of = self._worn_set(asked)
        if of is not None:
            arrays["plane"] = plane = self.scene.plane(self.worn, of)
            head["plane"] = {"set": asked.get("set"), "side": of.side}
            head["planeSize"] = [plane.shape[1], plane.shape[0]]

    def _worn_set(self, asked: Mapping[str, Any]) -> WornSet | None:
        what = self.checked.sets.get(asked.get("set", -1))
        return next((s for s in self.worn.sets if s.what is what and s.side == asked.get("side", "")), None) if what else None

    def _seek(self, asked: Any, values: Mapping[str, float]) -> dict[str, float]:
        of = self._worn_set(_table(asked))
        return {} if of is None else strongest(of.what.entry.drive, of.side, self.scene.avatar.skeleton, values)

    def _unfit(self) -> list[SetFault]:
        return [SetFault(f"{name}: {reason}") for name, reason in self.worn.left_out.items()]

    def _jitters(self) -> list[dict[str, Any]]:
        """Control points moved by wrinkledness, in the shape's unit, for each wrinkle with wrinkledness."""
        out: list[dict[str, Any]] = []
        for k, each in self.checked.sets.items():
            for n, w in enumerate(each.entry.wrinkles):
                if w.wrinkledness > 0.0:
                    shape = each.shape(w.shape)
                    moved = Instance(shape, (0.0, 0.0), (1.0, 1.0), 1.0, 1.0, wrinkledness=w.wrinkledness, seed=w.seed)
                    out.append({"set": k, "wrinkle": n, "branches": [p.round(5).tolist() for p in moved.control_points()]})
        return out

    def regions(self) -> list[dict[str, Any]]:
        """Every region with the size of its plane [m], for somebody REFERENCE_HEIGHT tall, on each side that the avatar has."""
        scale = self.scene.avatar.skeleton.height / REFERENCE_HEIGHT
        out: list[dict[str, Any]] = []
        for name, region in builtin_regions().items():
            planes: dict[str, list[float]] = {}
            for side in sides_of(region):
                try:
                    around = tube(self.scene.avatar, region, side)
                except WrinkleError:
                    continue
                planes[side] = [round(x / scale, 5) for x in around.plane]
            out.append({"name": name, "sides": region.sides, "planes": planes, "knots": region.knots})
        return out


def _table(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
