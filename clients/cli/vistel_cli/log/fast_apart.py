"""Windows of a fast replay, computed in a process of their own."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import sys
from collections.abc import Iterator
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

from vistel_cli.log.fast_sites import Window


def can_be_apart() -> bool:
    """Whether there is a core for a second process, and a way to make it as a copy of this one."""
    return sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1 and not multiprocessing.current_process().daemon


def computed_apart(windows: Iterator[Window]) -> Iterator[Window]:
    """The same windows, computed ahead by another process. Raises what it raises, and RuntimeError where it ends without a word."""
    forking = multiprocessing.get_context("fork")
    here, there = forking.Pipe(duplex=False)
    process = forking.Process(target=_work, args=(windows, here, there), daemon=True)
    process.start()
    there.close()
    try:
        while (said := _received(here, process)) is not None:
            if isinstance(said, BaseException):
                raise said
            yield said
    finally:
        here.close()
        process.terminate()
        process.join()


def _received(here: Connection, process: BaseProcess) -> Window | BaseException | None:
    try:
        return here.recv()
    except EOFError:
        process.join()
        raise RuntimeError(f"the process that computes postures ended with {process.exitcode}") from None


def _work(windows: Iterator[Window], here: Connection, there: Connection) -> None:
    here.close()  # so that this process notices when the other one ends
    try:
        for window in windows:
            there.send(window)
        there.send(None)
    except (BrokenPipeError, KeyboardInterrupt):
        return  # nobody asks any more
    except Exception as e:
        there.send(_sendable(e))


def _sendable(error: Exception) -> Exception:
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(repr(error))
    return error
