"""Commands for panels: pages are put up before everybody, turned and taken away."""

from dataclasses import replace

from vistel.one_line import one_line
from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.arguments import Which
from vistel.space.commands import create
from vistel.space.commands.context import Answer, Context, changed, performs
from vistel.space.commands.panel import ASPECTS, MOST_PAGES, SHAPE, panel
from vistel.space.commands.panel_place import panel_place
from vistel.space.commands.reference import fits
from vistel.space.history import PlacedThing
from vistel.space.state import State
from vistel.space.things.things import Pages, Thing

MOST_OF_ONE = 4
"""Panels that one participant may have put up at a time."""
MOST_PANELS = 12
"""In the room."""
MOST_LIVE = 4
"""Of these, that show somebody's screen: each is 1.5 Mbit/s to every site and page."""
MOST_TITLE = 60
"""Letters of a panel's name."""


@performs(ask.Present)
def present(context: Context, action: ask.Present) -> Answer:
    """Put up a panel where people see it best, turned to them. Of one participant, one panel is live: a new one replaces it. One
    that was put away can be shown again under its name; to take putting away back, what has its name must go first."""
    _check(context, action)
    before = live_of(context.state, context.who) if action.live else ()
    names = (t.name for t in context.state.things)
    number, name = create.called(name_from(action.title), SHAPE, context.ids(put_away=False), names)
    new = panel(number, name, action.aspect, Pages(action.pages, 0, context.who, action.live))
    spot, rotation = panel_place(context, new)
    new = replace(new, position=spot, rotation=rotation)
    return changed(context, before, [PlacedThing(new, spot, rotation)]), (new.id,)


def live_of(state: State, participant: str) -> tuple[int, ...]:
    """The row of the live panel of a participant; empty: none."""
    things = enumerate(state.things)
    return tuple(n for n, t in things if t.pages is not None and t.pages.live and t.pages.by == participant)


@performs(ask.TurnPage)
def turn_page(context: Context, action: ask.TurnPage) -> Answer:
    """Show another page; beyond the last and the first there is none."""
    n = _panel_meant(context, action.which)
    thing = context.state.things[n]
    assert thing.pages is not None
    shown = round(action.page) - 1 if action.page else thing.pages.shown + round(action.by)
    count = len(thing.pages.models)
    if not 0 <= shown < count:
        raise Refused(f"no such page of the panel {thing.name!r}: it has {count}, and shows page {thing.pages.shown + 1}")
    after = replace(context.placed(n), thing=_showing(thing, thing.pages, shown), dents=context.dents(n))
    return changed(context, (n,), [after]), (thing.id,)


@performs(ask.PutAway)
def put_away(context: Context, action: ask.PutAway) -> Answer:
    """Take a panel out of the room."""
    n = _panel_meant(context, action.which)
    return changed(context, (n,), ()), (context.state.things[n].id,)


def name_from(title: str) -> str:
    """A title as the name of a thing for people: in one line, and not too long."""
    return one_line(title)[:MOST_TITLE]


def _check(context: Context, action: ask.Present) -> None:
    if not 0 < len(action.pages) <= MOST_PAGES:
        raise Refused(f"a panel has 1 to {MOST_PAGES} pages, not {len(action.pages)}")
    if not all(len(page) == 32 and set(page) <= set("0123456789abcdef") for page in action.pages):
        raise Refused("a page is named by the 32 hexadecimal digits of its polymesh")
    if not ASPECTS[0] <= action.aspect <= ASPECTS[1]:
        raise Refused(f"pages are {ASPECTS[0]:g} to {ASPECTS[1]:g} times as wide as high, not {action.aspect:g} times")
    if action.live and len(action.pages) > 1:
        raise Refused(f"a live panel has one page, not {len(action.pages)}")
    there = [t.pages for t in context.state.things if t.pages is not None]
    if action.live:
        there = [pages for pages in there if not (pages.live and pages.by == context.who)]
        if sum(pages.live for pages in there) >= MOST_LIVE:
            raise Refused(f"{MOST_LIVE} in the room show something live already")
    if sum(pages.by == context.who for pages in there) >= MOST_OF_ONE:
        raise Refused(f"you have put up {MOST_OF_ONE} panels; put one away first")
    if len(there) >= MOST_PANELS:
        raise Refused(f"the room has {MOST_PANELS} panels; put one away first")


def _panel_meant(context: Context, which: Which) -> int:
    """The row of a panel that the speaker may change."""
    things = context.state.things
    panels = [n for n, t in enumerate(things) if t.pages is not None]
    if not which.is_this:
        n = context.one(which, [n for n in panels if fits(which, things[n])])
        if n not in panels:
            raise Refused(f"the {things[n].name} shows no pages")
    elif panels:
        own = [n for n in panels if (pages := things[n].pages) is not None and pages.by == context.who]
        n = (own or panels)[-1]
    else:
        raise Refused("nobody shows anything; put something up first")
    context.check_mine(n)
    return n


def _showing(thing: Thing, pages: Pages, shown: int) -> Thing:
    """The thing with another of its pages, also where it is bent."""
    before, now = pages.models[pages.shown], pages.models[shown]

    def turned(t: Thing) -> Thing:
        return replace(t, looks=tuple(replace(k, model=now) if k.model == before else k for k in t.looks))

    curve = thing.curve and replace(thing.curve, straight=turned(thing.curve.straight))
    return replace(turned(thing), curve=curve, pages=replace(pages, shown=shown))
