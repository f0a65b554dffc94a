"""The names of devices. They are made only here and never taken apart: `vistel.conference.device_list` finds the device of a
name."""

from typing import Literal

Side = Literal["left", "right"]


def tracker_name(participant: str, unit: int = 1) -> str:
    """A participant's tracker. unit: 1, or 2 for the second of two that are synchronised."""
    return both_units(f"{participant}-tracker")[unit - 1]


def both_units(tracker: str) -> tuple[str, str]:
    """The names of two trackers that are synchronised, from that of the first."""
    return tracker, f"{tracker}-2"


def prop_tracker_name(thing: str) -> str:
    """The tracker of a thing of the room."""
    return tracker_name(f"prop-{thing}")


def glove_name(participant: str, side: Side) -> str:
    """A participant's glove."""
    return f"{participant}-glove-{side}"


def face_name(participant: str) -> str:
    """A participant's phone or face camera."""
    return f"{participant}-face"


def eye_name(participant: str) -> str:
    """A participant's eye camera."""
    return f"{participant}-eye"


def pointer_name(participant: str) -> str:
    """The page of a guest, with its mouse and keys."""
    return f"{participant}-pointer"


def camera_body_name(participant: str) -> str:
    """The camera of a guest's page, which sees their body."""
    return f"{participant}-camera"


def headset_name(participant: str) -> str:
    """The headset of a guest's page, with its controllers or the hands that it sees."""
    return f"{participant}-headset"


def microphone_name(participant: str) -> str:
    """A participant's simulated microphone."""
    return f"{participant}-microphone"


def equipment_name(site: str, equipment: str) -> str:
    """A simulated device of a site's room on Modbus."""
    return f"{site}-{equipment}"
