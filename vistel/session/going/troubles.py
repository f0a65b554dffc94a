"""What is wrong in a conference, in words that say what to do, from figures of how it goes.

The words stay the same while the figures change: each trouble is one."""

from __future__ import annotations

from typing import Any

SILENT_S = 3.0
"""Who publishes once a second and has not for so long is silent."""
OLD_S = 1.0
"""Motion that is older has stopped."""
FEW_PICTURES = 10.0
"""A second; fewer are no motion any more."""


def troubles(rows: dict[str, list[dict[str, Any]]], devices: list[dict[str, Any]]) -> list[str]:
    """What is wrong, a line each with what to do."""
    out = [f"{s['node']} is silent; its log says why" for s in rows["services"] if s["silent_s"] > SILENT_S]
    for site in (s for s in rows["sites"] if s["draws"]):
        if site.get("silent_s", 0.0) > SILENT_S:
            out.append(f"{site['name']} draws no pictures; see the log of its renderer")
        elif site.get("pictures_per_s", FEW_PICTURES) < FEW_PICTURES:
            out.append(f"{site['name']} draws less than {FEW_PICTURES:.0f} pictures a second; its machine is busy")
    down: dict[str, list[str]] = {}
    for device in devices:
        if device["state"] not in ("streaming", "absent"):
            down.setdefault(device["detail"] or device["state"], []).append(device["name"])
    out += [f"{', '.join(names)}: {why}; vistel doctor looks at devices" for why, names in down.items()]
    return out + [
        f"{p['shown']} stands still: no motion comes; see the site's devices" for p in rows["people"] if p["age_ms"] > OLD_S * 1e3
    ]
