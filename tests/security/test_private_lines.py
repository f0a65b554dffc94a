"""Somebody tries to read private lines of others, or to write in the name of somebody else. What it needs: any certificate of the
conference that may listen, or the link of a guest."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from secured_bus import Secured, secured
from waiting import until

from vistel.messages.chat import line_message
from vistel.session.chat import Chat, lines_of
from vistel.wire.clock import SystemClock
from vistel.wire.owners import Owners
from vistel.wire.topics import BY_NAME

LINE = BY_NAME["private_line"]
PEOPLE = {"paris": ["ann"], "tokyo": ["bob", "cho"], "osaka": ["eve"], "hub": []}
OWNERS = Owners({site: {"participant": people} for site, people in PEOPLE.items()})


@pytest.mark.parametrize("name", ["osaka", "guest"])
@pytest.mark.parametrize("all_may_ask", [True, False], ids=["without the rule", "with it"])
def test_no_third_site_gets_a_private_line_however_it_asks(tmp_path: Path, name: str, all_may_ask: bool) -> None:
    """Ann in paris writes to Bob in tokyo. osaka is a site like these, guest an observer."""

    async def body(s: Secured) -> None:
        keys = [
            LINE.pattern("demo"),
            LINE.pattern("demo", reader_site="tokyo"),
            "vistel/demo/**",
            "**",
            "vistel/demo/site/paris/**",
        ]
        heard: list[str] = []
        third = s.session(name)
        held = [third.declare_subscriber(key, lambda sample: heard.append(str(sample.key_expr))) for key in keys]
        to_all: list[str] = []
        held.append(third.declare_subscriber(BY_NAME["chat"].pattern("demo"), lambda sample: to_all.append(str(sample.key_expr))))
        paris, tokyo, hub = [await s.door(site, owners=OWNERS) for site in ("paris", "tokyo", "hub")]
        readers = [Chat(tokyo, "private_line", reader_site="tokyo", reader="bob"), Chat(hub, "private_line")]
        public, private = lines_of(paris, "ann"), lines_of(paris, "ann", "bob", "tokyo")

        def written() -> bool:
            """The reader and the hub have the line; each line to all comes after it."""
            private.put(line_message("a secret", SystemClock().now_ns()))
            public.put(line_message("hello", SystemClock().now_ns()))
            for chat in readers:
                chat.take()
            return bool(to_all) and all(chat.lines for chat in readers)

        await until(written)
        before = len(to_all)
        await until(lambda: written() and len(to_all) > before + 2)  # what was on its way has come, and later lines too
        assert {(n.participant, n.to, n.text) for chat in readers for n in chat.lines} == {("ann", "bob", "a secret")}
        told = await asyncio.to_thread(lambda: [str(r.ok.key_expr) for key in keys for r in third.get(key) if r.ok is not None])
        private_keys = [key for key in (*heard, *told) if "/private/" in key]
        assert bool(private_keys) == all_may_ask, "what was written before is not told either"
        assert held

    secured(tmp_path, body, all_may_ask=all_may_ask)


def test_who_writes_in_anothers_name_or_to_nobody_of_that_site_is_not_read(tmp_path: Path) -> None:
    """Eve in osaka writes as Ann under osaka's own keys, as Ann under the keys of paris, and to somebody who is at another site."""

    async def body(s: Secured) -> None:
        osaka, tokyo, paris = [await s.door(site, owners=OWNERS) for site in ("osaka", "tokyo", "paris")]
        raw = s.session("osaka")
        chat = Chat(tokyo, "private_line", reader_site="tokyo")
        own, foreign = lines_of(osaka, "ann", "bob", "tokyo"), lines_of(osaka, "eve", "ann", "tokyo")
        last = lines_of(osaka, "eve", "bob", "tokyo")
        stolen = LINE.format(conference="demo", site="paris", participant="ann", reader_site="tokyo", reader="bob")

        def written() -> bool:
            message = line_message("hello", SystemClock().now_ns())
            raw.put(stolen, message.SerializeToString())
            for lines in (own, foreign, last):
                lines.put(message)
            chat.take()
            return bool(chat.lines)

        await until(written)
        lines_of(paris, "ann", "cho", "tokyo").put(line_message("from ann herself", 1))
        await until(lambda: written() and any(n.to == "cho" for n in chat.lines))
        assert tokyo.counters.refused["private_line"] >= 2
        assert {(n.participant, n.to) for n in chat.lines} == {("eve", "bob"), ("ann", "cho")}

    secured(tmp_path, body)
