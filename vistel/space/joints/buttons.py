"""Buttons: joints that are pressed and released, each once, however a finger trembles."""

from collections.abc import Sequence
from dataclasses import dataclass

from vistel.arrays import F64
from vistel.space.joints.joined import Joined


@dataclass(frozen=True)
class ButtonEvent:
    """A button was pressed, or released. joint, thing: ids of the joint and of the thing that hangs on it; participant: who
    touched it, empty when nobody did."""

    joint: str
    thing: str
    pressed: bool
    participant: str = ""


def button_events(was: Sequence[str], joined: Joined, position: F64, rotation: F64) -> tuple[ButtonEvent, ...]:
    """What has become of the buttons, with things at `position` (N, 3) and `rotation` (N, 4). was: ids of the joints whose
    buttons were pressed a step ago."""
    out: list[ButtonEvent] = []
    for k, joint in enumerate(joined.joints):
        if joint.button is None:
            continue
        at = joined.coordinate(k, position, rotation)
        pressed = joint.id in was
        if pressed and at > joint.button.release:
            out.append(ButtonEvent(joint.id, joint.thing, False))
        elif not pressed and at < joint.button.press:
            out.append(ButtonEvent(joint.id, joint.thing, True))
    return tuple(out)


def pressed_after(was: Sequence[str], events: Sequence[ButtonEvent]) -> tuple[str, ...]:
    """Ids of the joints whose buttons are pressed after `events`, sorted."""
    released = {e.joint for e in events if not e.pressed}
    return tuple(sorted({*was, *(e.joint for e in events if e.pressed)} - released))
