"""Zenoh configurations: the settings under which it behaves as a conference needs.

Several of Zenoh's defaults fail badly here, so every session is opened from this module:

- no scouting, explicit endpoints: nothing on the network joins a conference by accident;
- `wait_before_close` below the lease: else a link that was cut for longer than the lease never carries data
  again;
- reconnect every 250 ms, over QUIC once the router answers (`vistel.wire.zenoh.gate`): the default backs off to 4 s;
- one link per transport: access rules are not enforced on the others. QUIC counts as one;
- over QUIC, what may be lost goes in datagrams (`mixed_rel`): with one stream for all, a lost packet holds back what follows it;
- shared memory off, small transmit queues: a queue is latency;
- nothing larger than `MOST_MESSAGE_BYTES` is gathered from its fragments: the default is 1 GiB.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vistel.wire.limits import MOST_MESSAGE_BYTES
from vistel.wire.zenoh.access import question_limits

LEASE_MS = 2000
"""A silent neighbour is gone after this; presence follows."""
OPEN_MS = 3000
"""A router that takes a connection and says nothing for so long hangs, and the next one is tried. The default is ten seconds; with
one second nobody meets over a link of 150 ms one way that loses 5 % (docs/explanation/networks.md)."""

RETRY_MS = 25
"""From one attempt at a router to the next where attempts fail at once while there is none (`vistel.wire.zenoh.gate`)."""

Json = dict[str, Any]


@dataclass(frozen=True)
class TlsFiles:
    """Paths of the certificates a node shows and trusts (PEM; mutual TLS)."""

    ca: Path
    certificate: Path
    key: Path


def client_config(endpoints: list[str], tls: TlsFiles | None = None, connect_s: float = 5.0, local: str = "") -> Json:
    """A session that connects to the first router of `endpoints` that answers and comes back to it when it was away. local: the
    address from which it connects, where `vistel.wire.zenoh.gate` says when."""
    first_ms, most_ms = (RETRY_MS, RETRY_MS) if local else (250, 500)
    return {
        "mode": "client",
        "connect": {
            "endpoints": [_with_datagrams(e) + (f"#bind={local}" if local else "") for e in endpoints],
            "timeout_ms": round(connect_s * 1000),
            "exit_on_failure": True,
            "retry": {"period_init_ms": first_ms, "period_max_ms": most_ms, "period_increase_factor": 2},
        },
        "queries_default_timeout": 2000,
        **_common(tls, listens=False),
    }


def router_config(
    listen: list[str], tls: TlsFiles | None = None, access: Json | None = None, connect: list[str] | None = None
) -> Json:
    """A session that routes. `access`: see `vistel.wire.zenoh.access`; `connect`: routers to join, over a thin link perhaps."""
    config: Json = {
        "mode": "router",
        "listen": {"endpoints": [_with_datagrams(e) for e in listen]},
        "adminspace": {"enabled": False},
        "downsampling": question_limits(),
        **_common(tls, listens=True),
    }
    if connect:
        config["connect"] = {
            "endpoints": [_with_datagrams(e) for e in connect],
            "timeout_ms": -1,
            "exit_on_failure": False,
            "retry": {"period_init_ms": 500, "period_max_ms": 500, "period_increase_factor": 1},
        }
        # Small batches and a small socket buffer bound the queue that a thin uplink can build up.
        config["transport"]["link"]["tx"]["batch_size"] = 8192
        if tls:
            config["transport"]["link"]["tls"]["so_sndbuf"] = 16384
    if access:
        config["access_control"] = access
    return config


def _with_datagrams(endpoint: str) -> str:
    return f"{endpoint}?mixed_rel=1" if endpoint.startswith("quic/") and "?" not in endpoint else endpoint


def _common(tls: TlsFiles | None, listens: bool) -> Json:
    link: Json = {
        "rx": {"max_message_size": MOST_MESSAGE_BYTES},
        "tx": {
            "lease": LEASE_MS,
            "keep_alive": 4,
            "queue": {
                "size": {"data": 8, "data_low": 8, "real_time": 8, "interactive_high": 8},
                "congestion_control": {"drop": {"wait_before_drop": 1000}, "block": {"wait_before_close": 200_000}},
            },
        },
    }
    if tls:
        link["protocols"] = ["tls", "quic"]
        link["tls"] = {
            "root_ca_certificate": str(tls.ca),
            "enable_mtls": True,
            "connect_certificate": str(tls.certificate),
            "connect_private_key": str(tls.key),
            "close_link_on_expiration": True,
        }
        if listens:
            link["tls"] |= {"listen_certificate": str(tls.certificate), "listen_private_key": str(tls.key)}
    return {
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {
            "unicast": {"max_links": 1, "max_sessions": 1000, "open_timeout": OPEN_MS},
            "shared_memory": {"enabled": False},
            "link": link,
        },
    }


def as_text(config: Json) -> str:
    """For `zenoh.Config.from_json5`, and for a file that `zenohd -c` reads."""
    return json.dumps(config, indent=2) + "\n"
