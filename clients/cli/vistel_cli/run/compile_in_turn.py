"""Lets processes compile side by side: each kernel is compiled by one of them; the others wait, and read it from the disk.

What a kernel calls is compiled under a lock of its own. No kernel calls itself through others, so nobody waits in a circle.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from vistel.figure.avatar.cache_folder import file_lock

_dispatcher: Any = import_module("numba.core.dispatcher").Dispatcher
_event: Any = import_module("numba.core.event")


def compile_in_turn(told: Callable[[], object]) -> None:
    """From now on this process takes turns with others of its kind at each kernel. told: called when it compiles one."""
    compile_one, held = _dispatcher.compile, set[str]()

    def in_turn(kernel: Any, signature: Any) -> Any:
        index = getattr(getattr(kernel._cache, "_cache_file", None), "_index_path", None)
        if index is None or index in held:
            return compile_one(kernel, signature)
        held.add(index)
        try:
            with file_lock(Path(f"{index}.lock")):
                return compile_one(kernel, signature)
        finally:
            held.remove(index)

    class Listener(_event.Listener):
        def on_start(self, event: Any) -> None:
            told()

        def on_end(self, event: Any) -> None:
            pass

    _dispatcher.compile = in_turn
    _event.register("numba:compile", Listener())
