"""Order and repair of reliable messages, without a network."""

from __future__ import annotations

import random

from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.wire.reliable import CACHE_MESSAGES, Quota, ReceiveOrder, SendCache, Stamp


def sent(count: int, epoch: int = 7) -> tuple[SendCache, list[tuple[Stamp, bytes]]]:
    cache = SendCache(epoch)
    return cache, [(cache.append(p), p) for p in (b"%d" % n for n in range(1, count + 1))]


def repair(order: ReceiveOrder, cache: SendCache) -> list[bytes]:
    """Ask the sender for what is missing until nothing is."""
    out: list[bytes] = []
    while gap := order.missing():
        for stamp, payload in cache.between(*gap):
            out += order.offer(stamp, payload)
    return out


@settings(max_examples=60)
@given(count=st.integers(1, 300), loss=st.floats(0.0, 0.95), seed=st.integers(0, 2**32))
def test_whatever_is_lost_doubled_or_swapped_arrives_once_and_in_order(count: int, loss: float, seed: int) -> None:
    rng = random.Random(seed)
    cache, messages = sent(count)
    order = ReceiveOrder.starting(Stamp(7, 1, 1), from_last=False)
    arrivals = [m for m in messages if rng.random() >= loss]
    arrivals += rng.sample(messages, len(messages) // 3)
    rng.shuffle(arrivals)
    got: list[bytes] = []
    for stamp, payload in arrivals:
        got += order.offer(stamp, payload)
    got += order.offer(cache.beat(), b"")
    got += repair(order, cache)
    assert got == [p for _, p in messages]
    assert order.lost == 0


def test_a_loss_at_the_end_is_noticed_by_the_senders_beat() -> None:
    cache, messages = sent(3)
    order = ReceiveOrder.starting(messages[0][0], from_last=False)
    assert order.offer(*messages[0]) == [b"1"]
    assert order.missing() is None
    assert order.offer(cache.beat(), b"") == []
    assert order.missing() == (2, 3)


def test_a_late_joiner_starts_at_the_last_value() -> None:
    cache, _ = sent(50)
    stamp, payload = cache.last()
    order = ReceiveOrder.starting(stamp, from_last=True)
    assert order.offer(stamp, payload) == [b"50"]
    assert order.missing() is None


def test_a_sender_that_restarts_counts_anew_and_its_old_messages_are_ignored() -> None:
    _, old = sent(5, epoch=1)
    _, new = sent(2, epoch=2)
    order = ReceiveOrder.starting(old[0][0], from_last=False)
    got = [p for m in old for p in order.offer(*m)] + [p for m in new for p in order.offer(*m)]
    assert got == [b"1", b"2", b"3", b"4", b"5", b"1", b"2"]
    assert order.offer(*old[4]) == []


def test_what_the_sender_no_longer_has_is_counted_as_lost() -> None:
    cache, messages = sent(CACHE_MESSAGES + 10)
    order = ReceiveOrder.starting(messages[0][0], from_last=False)
    got = order.offer(*messages[0]) + order.offer(cache.beat(), b"") + repair(order, cache)
    assert order.lost == 9
    assert len(got) == CACHE_MESSAGES + 1


def test_giving_up_delivers_what_waits_behind_the_gap() -> None:
    _, messages = sent(4)
    order = ReceiveOrder.starting(messages[0][0], from_last=False)
    order.offer(*messages[0])
    order.offer(*messages[3])
    assert order.give_up() == [b"4"]
    assert order.lost == 2


def test_an_absurd_stamp_costs_no_time() -> None:
    order = ReceiveOrder.starting(Stamp(1, 1, 1), from_last=False)
    order.offer(Stamp(1, 2**63, 2**63), b"x")
    assert order.next == 2**63 + 1


@settings(max_examples=20)
@given(count=st.integers(1, 200), loss=st.floats(0.0, 0.95), left=st.integers(0, 2000), seed=st.integers(0, 2**32))
def test_with_little_room_behind_gaps_everything_arrives_once_and_in_order_all_the_same(
    count: int, loss: float, left: int, seed: int
) -> None:
    rng = random.Random(seed)
    cache, messages = sent(count)
    quota = Quota(left)
    order = ReceiveOrder.starting(Stamp(7, 1, 1), from_last=False, quota=quota)
    got = [p for stamp, payload in messages if rng.random() >= loss for p in order.offer(stamp, payload)]
    got += order.offer(cache.beat(), b"") + repair(order, cache)
    assert got == [p for _, p in messages]
    assert order.lost == 0 and quota.left == left


@given(data=st.binary(max_size=40))
def test_a_broken_stamp_is_no_stamp(data: bytes) -> None:
    stamp = Stamp.from_bytes(data)
    assert (stamp is not None) == (len(data) == 24)
