"""The edited document: an avatar's sets of wrinkles as the page holds them. Each set is checked by itself, so that a fault
names its set."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from vistel.toml.file import TomlFile, parsed
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.sets_text import sets_text
from vistel.wrinkle.shape import WrinkleShape
from vistel.wrinkle.shape_file import builtin_shapes
from vistel.wrinkle.wrinkle_sets import SetsFile, WrinkleSet, sets_of

MOST_SETS = 64


@dataclass(frozen=True)
class SetFault:
    """A part that cannot be used. set: number of its set, None outside of a set; shape: name of one of the page's own shapes."""

    text: str
    set: int | None = None
    shape: str | None = None


@dataclass(frozen=True, eq=False)
class CheckedSets:
    """sets: the usable sets by their number; faults: the faults of the others."""

    sets: dict[int, WrinkleSet]
    faults: tuple[SetFault, ...]

    @property
    def whole(self) -> list[WrinkleSet]:
        """All sets in order. Raises WrinkleError where one cannot be used."""
        if self.faults:
            raise WrinkleError("\n".join(fault.text for fault in self.faults))
        return [self.sets[k] for k in sorted(self.sets)]


def page_form(sets: Sequence[WrinkleSet]) -> dict[str, Any]:
    """Sets as the page edits them: their own `shapes`, and `sets` with every key."""
    file = parsed(sets_text(sets), "wrinkles", WrinkleError).checked(SetsFile, WrinkleError)
    return file.model_dump(mode="json")


def check(form: Any, before: CheckedSets | None = None) -> CheckedSets:
    """Checks a page's form. before: result for the previous form; unchanged sets stay the same objects."""
    if not isinstance(form, dict) or not isinstance(form.get("sets"), list) or not isinstance(form.get("shapes", []), list):
        return CheckedSets({}, (SetFault("expected shapes and sets"),))
    if len(form["sets"]) > MOST_SETS:
        return CheckedSets({}, (SetFault(f"{len(form['sets'])} sets, expected at most {MOST_SETS}"),))
    faults: list[SetFault] = []
    own: dict[str, WrinkleShape] = {}
    for data in form.get("shapes", []):
        name = str(data.get("name", "")) if isinstance(data, dict) else ""
        try:
            shape = TomlFile(f"shape {name}", data).checked(WrinkleShape, WrinkleError)
        except WrinkleError as fault:
            faults += [SetFault(line, None, name) for line in str(fault).splitlines()]
            continue
        if shape.name in own or shape.name in builtin_shapes():
            faults.append(SetFault(f"shape {shape.name}: there is another of that name; rename it", None, shape.name))
        own[shape.name] = shape
    bad = {str(fault.shape): fault.text for fault in faults}

    def look(name: str) -> WrinkleShape:
        if name in own:
            return own[name]
        known = builtin_shapes()
        if name not in known:
            there = ", ".join([*own, *known])
            raise WrinkleError(bad.get(name, f"shape {name}: is not there; there are {there}"))
        return known[name]

    sets: dict[int, WrinkleSet] = {}
    names: set[str] = set()
    for k, data in enumerate(form["sets"]):
        name = str(data.get("name", k)) if isinstance(data, dict) else str(k)
        try:
            if name in names:
                raise WrinkleError(f"{name}: there is another set of that name; rename one")
            names.add(name)
            made = sets_of(TomlFile(name, {"sets": [data]}), look)[0]
        except WrinkleError as fault:
            for line in str(fault).splitlines():
                # A shape's fault is reported once, and stands for the set's too.
                of_shape = next((text for text in bad.values() if line.endswith(text)), None)
                faults.append(SetFault(of_shape or line.replace(": sets[0].", ": "), k))
            continue
        sets[k] = _same(made, before) or made
    return CheckedSets(sets, tuple(faults))


def _same(made: WrinkleSet, before: CheckedSets | None) -> WrinkleSet | None:
    if before is None:
        return None
    known = (old for old in before.sets.values() if old.entry == made.entry and dict(old.shapes) == dict(made.shapes))
    return next(known, None)
