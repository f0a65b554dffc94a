"""Access rules of a router, derived from the table of topics: who shows which certificate may say what.

The common name of a node's certificate is its site's name; the world shows `world`, the hub that keeps the time `hub`, an observer
any name that is listed as such. A router sees only the certificate of its direct neighbour: where sites have routers of their own,
the hub's router is the one that decides, and their routers show their site's certificate.
"""

from collections.abc import Collection, Sequence
from typing import Any

from vistel.host import HOST
from vistel.wire.topics import BY_NAME, TOPICS, Audience, Publisher
from vistel.wire.zenoh.common_names import common_name

WORLD_NAME = "world"
HUB_NAME = "hub"
ROUTER_NAME = "router"
"""A second router, which keeps these rules itself and passes on what everybody says."""

MOST_QUESTIONS_PER_S = {"world_snapshot": 20.0, "room_plan": 20.0, "certificate": 5.0}
"""By topic, how many questions a second a router passes on from each link: of those that everybody may ask, the ones that cost who
answers work. Others are asked in quick turns (clock, parts of assets), or by those alone who may have the room."""

_WORLDS_HEAR = [Audience.EVERYBODY, Audience.HOSTS, Audience.WORLDS]
_HUB_HEARS = [*_WORLDS_HEAR, Audience.HUB, Audience.READER]
_SAY = ["put", "delete", "declare_queryable", "reply"]
_PRESENCE = ["liveliness_token"]
_ASK = ["declare_subscriber", "query", "declare_liveliness_subscriber", "liveliness_query"]


def access_rules(
    conference: str,
    sites: Sequence[str],
    *,
    observers: Sequence[str] = (),
    worlds: Sequence[str] = (),
    hosts: Sequence[str] = (),
    world: str = WORLD_NAME,
    hub: str = HUB_NAME,
    revoked: Collection[str] = (),
) -> dict[str, Any]:
    """The `access_control` section of a Zenoh router's configuration.

    sites, observers, world, hub: common names of certificates. The hub runs the world, the recorder and the console of a
    conference, so it may say what the world says, and ask the world as the host; a `world` of its own may say only what the
    world says. worlds: those of the sites on whose machines a world runs; hosts: those of hosts; revoked: common names that
    count no more (`vistel.wire.zenoh.common_names`). Everybody listed may subscribe to and ask for what the table of topics
    lets them hear, topic by topic, and ask for what is under their own name; everything else is denied, silently as far as the
    one denied can see.
    """
    rules: list[dict[str, Any]] = [
        _rule("presence", "ingress", _ASK, [f"vistel/{conference}/alive/**"]),
        _rule("hear", "egress", [*_SAY, *_PRESENCE, *_ASK], [f"vistel/{conference}/**"]),
    ]
    for audience in Audience:
        heard = [t.pattern(conference) for t in TOPICS if t.audience is audience]
        rules.append(_rule(f"listen-{audience.value}", "ingress", _ASK if audience is not Audience.HOLDER else ["query"], heard))
    policies: list[dict[str, Any]] = []
    subjects: list[dict[str, Any]] = []

    def allow(name: str, keys: list[str], *present_as: str, hears: Sequence[Audience] = (Audience.EVERYBODY,)) -> None:
        mine = [f"{name}-holds", f"{name}-reads"]
        held = [t.pattern(conference, holder=name) for t in TOPICS if t.audience is Audience.HOLDER]
        read = [t.pattern(conference, reader_site=name) for t in TOPICS if t.audience is Audience.READER]
        rules.extend((_rule(mine[0], "ingress", ["query"], held), _rule(mine[1], "ingress", _ASK, read)))
        if keys:
            rules.append(_rule(f"{name}-say", "ingress", _SAY, keys))
            present = [f"vistel/{conference}/alive/{n}/**" for n in (name, *present_as)]
            rules.append(_rule(f"{name}-alive", "ingress", _PRESENCE, present))
            mine += [f"{name}-say", f"{name}-alive"]
        subjects.append({"id": name, "cert_common_names": [common_name(name, revoked)]})
        policies.append({"rules": [*mine, *(f"listen-{a.value}" for a in hears), "presence", "hear"], "subjects": [name]})

    world_keys = _keys(Publisher.WORLD, conference, world)
    hub_site = _keys(Publisher.SITE, conference, hub, "heartbeat", "clock_offset")
    for site in sites:
        own = _keys(Publisher.SITE, conference, site)
        if site in worlds:
            allow(site, own + world_keys + hub_site, hub, hears=_WORLDS_HEAR)
        else:
            allow(site, own, hears=[Audience.EVERYBODY, *([Audience.HOSTS] if site in hosts else [])])
    allow(world, world_keys + _keys(Publisher.SITE, conference, world, "heartbeat", "clock_offset"), hears=_WORLDS_HEAR)
    host_asks = BY_NAME["command"].pattern(conference, site=hub, participant=HOST)
    allow(hub, [*world_keys, *_keys(Publisher.HUB, conference, hub), *hub_site, host_asks], hears=_HUB_HEARS)
    allow(ROUTER_NAME, [f"vistel/{conference}/**"], "*", hears=list(Audience))
    for observer in observers:
        allow(observer, [])
    return {"enabled": True, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies}


def question_limits() -> list[dict[str, Any]]:
    """The `downsampling` section of a router's configuration, which Zenoh counts for each link by itself."""
    rules = [{"key_expr": t.pattern(), "freq": MOST_QUESTIONS_PER_S[t.name]} for t in TOPICS if t.name in MOST_QUESTIONS_PER_S]
    return [{"id": "questions", "messages": ["query"], "flows": ["ingress"], "rules": rules}]


def _keys(publisher: Publisher, conference: str, site: str, *only: str) -> list[str]:
    """Key expressions of what `publisher` may say, one per topic."""
    return [t.pattern(conference, site=site) for t in TOPICS if t.publisher is publisher and (not only or t.name in only)]


def _rule(name: str, flow: str, messages: list[str], keys: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": keys}
