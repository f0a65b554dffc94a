"""What a page says in words."""

from __future__ import annotations

import json
from typing import Any, cast


def words_of(text: str) -> dict[str, object]:
    """A page's JSON; empty for what is none."""
    try:
        said: Any = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return cast("dict[str, object]", said) if isinstance(said, dict) else {}
