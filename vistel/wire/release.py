"""Versions of VISTEL that meet: those that speak the same messages, whatever else is new in one of them.

A field that one version does not know is passed over (protocol buffers), so releases meet as long as `MESSAGE_VERSION` is the same;
it changes only with a major release.
"""

from vistel.wire.topics import MESSAGE_VERSION

RELEASE = "0.1.0"
"""The version of the package; pyproject.toml reads it here. To ask the installed package for it takes a command longer."""


def release() -> str:
    """The version that is installed here."""
    return RELEASE


def objection(theirs: str, messages: int) -> str:
    """Why this machine and a hub with release `theirs` cannot meet, and what to update; empty where they can. messages: its
    MESSAGE_VERSION, 0 of a hub that does not say."""
    if messages in (0, MESSAGE_VERSION):
        return ""
    behind, newer = ("this machine", theirs) if messages > MESSAGE_VERSION else ("the hub", release())
    return (
        f"the hub has VISTEL {theirs[:32]}, this machine {release()}, and their messages differ; "
        f"update {behind}: pip install --upgrade 'vistel=={newer}'"
    )
