"""A process that has everything loaded and forks the processes of a conference, so that none of them has to load.

python -m vistel_services.process.fork_server CONFERENCE.toml vistel_services.world vistel_services.renderer

Loading is most of what a start costs: the compiler's modules, compiled kernels, people, the room. Says "ready" on
standard output when done and reads orders on standard input, a line of JSON each: {"module": what has a `main`, "log":
FILE, "arguments": [what it takes], "title": what `ps` shows}. Each is answered with the number of the process that does
it. That process is no child of this one: it is orphaned at birth, and whoever has made itself the reaper of orphans
(`vistel_services.process.forking`) becomes its parent. When the input ends, this process ends; what it forked lives on, until
that parent ends too.

Forking is sound as long as this process has one thread and holds nothing that cannot be shared: no bus, no OpenGL, no
event loop. With a second thread it refuses to begin.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import gc
import importlib
import json
import logging
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NoReturn

from setproctitle import setproctitle

from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference
from vistel.wire import alive
from vistel_services.process import logs
from vistel_services.process.forking import READY

log = logging.getLogger("vistel.fork_server")


@dataclass(frozen=True)
class Order:
    """What to fork."""

    module: str
    log: str
    arguments: tuple[str, ...]
    title: str

    @staticmethod
    def parse(line: bytes) -> Order:
        """Raises ValueError, KeyError or TypeError when it is none."""
        data = json.loads(line)
        return Order(data["module"], data["log"], tuple(data["arguments"]), data["title"])


def preload(conference: Conference, modules: Sequence[str]) -> None:
    """Import `modules` and let each load what it needs first."""
    for name in modules:
        started = time.perf_counter()
        module = importlib.import_module(name)
        imported = time.perf_counter()
        if hasattr(module, "preload"):
            module.preload(conference)
        log.info(
            "loaded module=%s imports_ms=%.0f preload_ms=%.0f",
            name,
            (imported - started) * 1e3,
            (time.perf_counter() - imported) * 1e3,
        )


def settle() -> None:
    """What is loaded stays as it is: the collector need not walk it, and the memory stays shared."""
    gc.collect()
    with contextlib.suppress(OSError, AttributeError):  # a C library other than GNU's
        ctypes.CDLL(None).malloc_trim(0)
    gc.freeze()


def fork(order: Order) -> int:
    """The number of a process that carries out `order`; it is nobody's child that could wait for it here."""
    reading, writing = os.pipe()
    reaper = os.getppid()
    between = os.fork()
    if between == 0:
        own = os.getpid()
        os.write(writing, str(os.fork() or _become(order, own, reaper)).encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        pid = int(pipe.read())
    os.waitpid(between, 0)
    return pid


def _become(order: Order, parent: int, reaper: int) -> NoReturn:
    """Be what `order` says, as a freshly started process would be, and end as it does. parent: who has forked it, and ends now;
    reaper: of orphans, who is its parent then, and with whom it ends."""
    code = 1
    try:
        os.setpgid(0, 0)
        while os.getppid() == parent:
            time.sleep(0.001)  # there is no event to wait for
        alive.end_with(reaper)
        _write_to(order.log)
        setproctitle(order.title)
        code = int(importlib.import_module(order.module).main(order.arguments) or 0)
    except SystemExit as e:
        code = e.code if isinstance(e.code, int) else 1
    except BaseException:
        log.exception("process failed")
    finally:
        logging.shutdown()
        os._exit(code)


def _write_to(log_file: str) -> None:
    """Standard output and error go to `log_file` from now on, standard input is empty, nothing else is open."""
    with open(log_file, "ab") as out, open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)
        os.dup2(out.fileno(), 1)
        os.dup2(out.fileno(), 2)
    os.closerange(3, os.sysconf("SC_OPEN_MAX"))


def serve(orders: BinaryIO, answers: int) -> None:
    """Carry out what is ordered until the input ends."""
    os.write(answers, READY)
    while (line := orders.readline()).endswith(b"\n"):
        try:
            pid = fork(Order.parse(line))
        except (ValueError, KeyError, TypeError, OSError) as e:
            log.error("not forked reason=%r order=%r", str(e), line[:200])
            pid = 0
        os.write(answers, b"%d\n" % pid)


def _voice() -> int:
    """The pipe to the supervisor; what libraries print goes where the log goes."""
    pipe = os.dup(1)
    os.dup2(2, 1)
    return pipe


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("conference", type=Path)
    parser.add_argument("modules", nargs="+", help="what is loaded")
    args = parser.parse_args()
    voice = _voice()
    logs.configure("fork/server", redirected=True)
    # USD reads rooms and figures in threads of its own, which it keeps; here in none.
    os.environ.setdefault("PXR_WORK_THREAD_LIMIT", "1")
    try:
        preload(load(args.conference), args.modules)
    except ConferenceError as e:
        print(e, file=sys.stderr)
        return 2
    except Exception:
        log.exception("loading failed")
        return 1
    threads = len(os.listdir("/proc/self/task"))
    if threads > 1:
        log.error("not forking threads=%d reason='a library has started threads, which do not survive it'", threads)
        return 1
    settle()
    serve(sys.stdin.buffer, voice)
    log.info("not needed any more")
    return 0


if __name__ == "__main__":
    sys.exit(main())
