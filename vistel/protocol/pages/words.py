"""What a page says in words."""

from __future__ import annotations

import json


def words_of(text: str) -> dict[str, object]:
    """A page's JSON; empty for what is none."""
    try:
        said = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return said if isinstance(said, dict) else {}
