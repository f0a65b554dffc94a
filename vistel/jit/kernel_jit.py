"""How kernels are compiled, and when a compiled one on disk is too old.

Numba takes a cached kernel for current as long as its own file has not changed, although it holds the code and the
constants of the files it calls. Here a kernel is stamped with the contents of its file and of every file of this
project that it imports, and those import: two machines with the same files run the same code.
"""

import hashlib
import pickle
import re
from collections.abc import Callable, Iterable
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar, overload

# Numba does not describe either in types.
_njit: Any = import_module("numba").njit
_unliteral: Any = import_module("numba").types.unliteral
F = TypeVar("F", bound=Callable[..., Any])
_FLAGS = {"nsz", "arcp", "contract", "afn", "reassoc"}
_IMPORT = re.compile(r"^(?:from\s+(vistel[\w.]*)\s+import\s+(\([^)]*\)|[^\n#]*)|import\s+(vistel[\w.]*))", re.MULTILINE)
_ROOT = Path(__file__).parents[2]


def _file_of(module: str, root: Path) -> Path | None:
    """The file of a module, by its dotted name; None where it is a package or no file under `root`."""
    path = root.joinpath(*module.split(".")).with_suffix(".py")
    return path if path.is_file() else None


def imported_files(source: str, root: Path) -> set[Path]:
    """Files of this project that a source text imports."""
    found: set[Path | None] = set()
    for package, names, module in _IMPORT.findall(source):
        found.add(_file_of(module or package, root))
        for name in re.findall(r"(\w+)(?:\s+as\s+\w+)?", names):
            found.add(_file_of(f"{package}.{name}", root))
    return {file for file in found if file is not None}


@cache
def _read(file: Path, root: Path) -> tuple[str, frozenset[Path]]:
    text = file.read_text("utf-8")
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest(), frozenset(imported_files(text, root))


@cache
def stamp_of(file: Path, root: Path = _ROOT) -> str:
    """The state of a file and of all it imports from this project, itself or through others."""
    seen: set[Path] = set()
    left = [file]
    while left:
        each = left.pop()
        if each not in seen:
            seen.add(each)
            left += _read(each, root)[1]
    return hashlib.blake2b("".join(sorted(_read(f, root)[0] for f in seen)).encode(), digest_size=16).hexdigest()


@overload
def compiled(function: F) -> F: ...
@overload
def compiled(**options: Any) -> Callable[[F], F]: ...
def compiled(function: Any = None, *, specialised: bool = False, **options: Any) -> Any:
    """`numba.njit` with a cache on disk that knows what the kernel is made of. Options as there.

    specialised: other kernels get it compiled for each literal number among the arguments that they call it with.
    """
    if function is None:
        return partial(compiled, specialised=specialised, **options)
    # No kernel is called from C.
    kernel = _njit(cache=True, no_cfunc_wrapper=True, **options)(function)
    file = getattr(kernel._cache, "_cache_file", None)
    if file is not None:
        file._source_stamp = (file._source_stamp, stamp_of(Path(function.__code__.co_filename)))
        file._load_index = partial(_index_or_none, file._load_index)
    if not specialised:
        kernel.get_call_template = partial(_typed_call, kernel.get_call_template)
    return kernel


def inner(function: F) -> F:
    """As `compiled`, for what only kernels call: it gets no entry from Python, which takes time to compile."""
    return compiled(no_cpython_wrapper=True)(function)


def is_cold(kernel: Any) -> bool:
    """True where `kernel` has never been compiled on this machine."""
    folder, module = kernel.stats.cache_path, Path(kernel.py_func.__code__.co_filename).stem
    return not folder or not any(Path(folder).glob(f"{module}.{kernel.__name__}*.nbi"))


def _typed_call(resolve: Callable[..., Any], arguments: Iterable[Any], keywords: dict[str, Any]) -> Any:
    """How a kernel is called by another, where literal numbers among its arguments are nothing special."""
    return resolve([_unliteral(a) for a in arguments], {name: _unliteral(a) for name, a in keywords.items()})


def _index_or_none(load: Callable[[], dict[Any, str]]) -> dict[Any, str]:
    """What is compiled already; nothing where it was by a version whose modules had other names, or is damaged."""
    try:
        return load()
    except (ImportError, AttributeError, EOFError, pickle.UnpicklingError, ValueError):
        return {}


def _compile(function: Callable[..., Any], flags: Any, inline: bool = False, **options: Any) -> Any:
    # Numba takes what is not said here, such as forceinline, from the first caller.
    return compiled(fastmath=flags, error_model="numpy", nogil=True, forceinline=inline, **options)(function)


def fast(function: Callable[..., Any]) -> Any:
    """A kernel or leaf: quick arithmetic, but NaN and infinities are what they are."""
    return _compile(function, _FLAGS)


def fast_inner(function: Callable[..., Any]) -> Any:
    """As `fast`, for what only kernels call."""
    return _compile(function, _FLAGS, no_cpython_wrapper=True)


def leaf(function: Callable[..., Any]) -> Any:
    """As `fast` for a leaf that calls `wide`: LLVM estimates reciprocals only where it need not think of
    infinities. Only kernels call it."""
    return _compile(function, _FLAGS | {"ninf"}, no_cpython_wrapper=True)


def inlined(function: Callable[..., Any]) -> Any:
    """A part of leaves that works on `Lanes`: it becomes code of its caller, so that values stay in registers."""
    return _compile(function, _FLAGS | {"ninf"}, inline=True, no_cpython_wrapper=True)


def reduction(function: Callable[..., Any]) -> Any:
    """A leaf that finds a largest value, which LLVM only vectorises where it need not think of NaN. Only kernels call
    it."""
    return _compile(function, True, no_cpython_wrapper=True)
