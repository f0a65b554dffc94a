"""Writes the reference page of topics from the table: `python -m vistel.wire.reference`."""

import math
from pathlib import Path

from vistel.wire.motion import FULL_INTERVAL_NS, MOTION_FIELDS, MotionField
from vistel.wire.topics import MESSAGE_VERSION, TOPICS, Audience, Delivery, Publisher, Topic

PAGE = Path(__file__).resolve().parents[2] / "docs/reference/topics.md"

_DELIVERY = {Delivery.NEWEST: "newest wins", Delivery.RELIABLE: "reliable", Delivery.QUERY: "query"}
_PUBLISHER = {Publisher.SITE: "its site", Publisher.WORLD: "the world", Publisher.HUB: "the hub"}
_AUDIENCE = {
    Audience.EVERYBODY: "everybody",
    Audience.HOSTS: "worlds and hosts",
    Audience.WORLDS: "worlds",
    Audience.HUB: "the hub",
    Audience.HOLDER: "who it is for",
    Audience.READER: "the site it is for, and the hub",
}


def page() -> str:
    """The whole page, Markdown."""
    rows = "\n".join(_row(t) for t in TOPICS)
    fields = "\n".join(
        f"| `{f.part}` | {f.name} | {f.count} | {f.low:.4g} … {f.high:.4g} {f.unit} | {_step(f)} | {f.group} |"
        for f in MOTION_FIELDS
    )
    return f"""# Topics and messages

<!-- Made by `python -m vistel.wire.reference` from vistel/wire/topics.py and vistel/wire/motion_codec/layout.py; do not edit. -->

Everything that crosses the bus, message version {MESSAGE_VERSION}. The messages are described in `proto/vistel/v1/*.proto`.

| topic | key | message | rate | delivery | published by | heard by | recorded | what |
|---|---|---|--:|---|---|---|---|---|
{rows}

* **Newest wins**: best effort. A slow reader skips old values. A message that arrives more than 250 ms later than usual for its
  sender is dropped and counted.
* **Reliable**: in order. While its sender lives nothing is lost, even if a router restarts. A late joiner gets the last value of
  each key.
* **Query**: a request and its answer.

Presence is under `vistel/{{conference}}/alive/{{site}}/{{token}}`. With certificates, a router lets each site
publish only under its own name, and subscribe and ask only where it is among those who may hear; the rules are made from this table
(`vistel.wire.zenoh.access`). [Who can do what](../security.md)

A message that does not parse, or has another version, is dropped and counted.

## Motion

`Motion.frame` has a posture in some forty bytes ([the bytes](motion-stream.md)). Every number is a whole number of
steps; a number outside its range is sent as the end of the range. A frame refers to a key frame shortly before it; at
least every {FULL_INTERVAL_NS / 1e9:g} s there is a full one, which refers to no other.

| part | numbers | count | range | step | group |
|---|---|--:|---|--:|--:|
{fields}
"""


def _step(f: MotionField) -> str:
    return f"{math.degrees(f.step):.4g} π/180 rad" if f.unit == "rad" else f"{f.step:.4g} {f.unit}"


def _row(t: Topic) -> str:
    rate = f"{t.rate_hz:g} Hz" if t.rate_hz else "on change" if t.delivery is not Delivery.QUERY else ""
    return (
        f"| `{t.name}` | `{t.key}` | `{t.message.DESCRIPTOR.name}` | {rate} | {_DELIVERY[t.delivery]} "
        f"| {_PUBLISHER[t.publisher]} | {_AUDIENCE[t.audience]} | {'yes' if t.recorded else 'no'} | {t.about} |"
    )


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
