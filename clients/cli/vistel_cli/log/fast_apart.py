"""A part of a fast replay in a process of its own."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
from collections.abc import Iterator
from multiprocessing.connection import Connection
from typing import Any, TypeVar

T = TypeVar("T")


def can_be_apart() -> bool:
    """Whether there is a core for a second process, and a way to make it as a copy of this one."""
    return sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1 and not multiprocessing.current_process().daemon


@contextlib.contextmanager
def computed_apart(items: Iterator[T]) -> Iterator[Iterator[T]]:
    """The same items, computed ahead by a copy of this process, for this one or for one more copy of it that is made within. They
    raise what `items` raises, and RuntimeError where the process ends without a word."""
    forking = multiprocessing.get_context("fork")
    here, there = forking.Pipe(duplex=False)
    process = forking.Process(target=_work, args=(items, here, there), daemon=True)
    process.start()
    there.close()
    try:
        yield _received(here)
    finally:
        here.close()
        process.terminate()
        process.join()


def _received(here: Connection) -> Iterator[Any]:
    while True:
        try:
            said = here.recv()
        except EOFError:
            raise RuntimeError("a process that computes a part of it ended without a word") from None
        if said is None:
            return
        if isinstance(said, BaseException):
            raise said
        yield said


def _work(items: Iterator[object], here: Connection, there: Connection) -> None:
    here.close()  # so that this process notices when the other one ends
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # it is ended by the one that began it
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # the command's own way to end raises, which no kernel expects
    try:
        for item in items:
            there.send(item)
        there.send(None)
    except BrokenPipeError:
        return  # nobody asks any more
    except Exception as e:
        there.send(_sendable(e))


def _sendable(error: Exception) -> Exception:
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(repr(error))
    return error
