"""The decorators for compiled code: ``@kernel`` for formulas, ``@entry`` for functions called from Python.

Entries are cached on disk under a digest of all sources that they depend on.
"""

import ast
import hashlib
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core.compiler_lock import global_compiler_lock

from leg_wear_monitor import whole_program
from leg_wear_monitor.code_cache import PACKAGE, code_directory, one_process_at_a_time

_Function = TypeVar("_Function", bound=Callable[..., object])

_ENTRY: dict[str, object] = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
_KERNEL = {**_ENTRY, "forceinline": True}

_HOME = Path(__file__).parent

at_compilation: list[Callable[[], None]] = []  # called when an entry is compiled, and not loaded


def _module(parts: Iterable[str]) -> Path | None:
    """File of a module of this package, from the parts of its name; None if there is none."""
    place = _HOME.joinpath(*parts)
    files = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in files if file.is_file()), None)


def _statements(tree: ast.AST) -> Iterator[ast.AST]:
    """All statements of a tree; `ast.walk` would go through the expressions, too, three times as long."""
    found = [tree]
    while found:
        node = found.pop()
        yield node
        for block in ("body", "orelse", "finalbody", "handlers", "cases"):
            found.extend(getattr(node, block, ()))


@cache
def _imported(source: Path) -> frozenset[Path]:
    """Files of this package that a file of it imports by their full names."""
    found: set[Path | None] = set()
    for node in _statements(ast.parse(source.read_bytes())):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
            found.update(_module(name) for package, *name in names if package == PACKAGE)
        elif isinstance(node, ast.ImportFrom) and node.module:
            package, *name = node.module.split(".")
            if package == PACKAGE:
                # the imported name is a module, or an object in a module
                found.update(_module([*name, alias.name]) or _module(name) for alias in node.names)
    return frozenset(file for file in found if file)


def _sources(roots: Iterable[Path]) -> set[Path]:
    """The given files and all files of this package that they import, directly or indirectly."""
    known: set[Path] = set()
    new = set(roots)
    while new:
        known |= new
        new = {source for known_one in new for source in _imported(known_one)} - known
    return known


def _digest(sources: Iterable[Path]) -> str:
    """Digest of names and contents of sources, of numba's version and of how it compiles: equal for copies.

    Code that was compiled with `whole_program` calls addresses, which plain numba gives as 0.
    """
    digest = hashlib.sha256(f"{numba.__version__} {whole_program.AVAILABLE}".encode())
    for source in sorted(sources):
        text = source.read_bytes()
        name = source.relative_to(_HOME) if source.is_relative_to(_HOME) else source
        digest.update(f"{name} {len(text)} ".encode())
        digest.update(text)
    return digest.hexdigest()[:16]


@cache
def cache_directory(root: Path | None = None) -> Path | None:
    """Directory of the compiled code of a file, named by a digest of all its sources.

    numba checks only the file of the cached function itself: after a change of a kernel in another file it
    would use the old code. The digest covers the file and everything that it imports. A directory outside the
    package also works if the package directory is read-only.

    Parameters
    ----------
    root : pathlib.Path, optional
        File of this package; default: all kernels of the package.

    Returns
    -------
    pathlib.Path or None
        Below ``$NUMBA_CACHE_DIR`` if set, else ``$XDG_CACHE_HOME`` or ``~/.cache``, else the temporary
        directory: the first that is private (`leg_wear_monitor.code_cache`). None if none is.
    """
    if root is None:
        compiled = (file for file in _HOME.rglob("*.py") if b"leg_wear_monitor.kernel" in file.read_bytes())
        return code_directory(f"all-{_digest(_sources(compiled))}")
    below = root.relative_to(_HOME) if root.is_relative_to(_HOME) else Path(root.name)
    return code_directory(f"{'.'.join(below.with_suffix('').parts)}-{_digest(_sources([root]))}")


def kernel(function: _Function) -> _Function:
    """Compile a formula of numbers and arrays; division by zero gives inf, as in numpy.

    A kernel cannot allocate arrays: it is compiled without numba's runtime, because its reference counting
    would cost more time than the physics where many small arrays are passed. A kernel is inlined into the
    entry that calls it and is not cached by itself, because cached code cannot be inlined.
    """
    if whole_program.AVAILABLE and not numba.config.DISABLE_JIT:
        return whole_program.KernelDispatcher(function, _KERNEL)
    return numba.njit(**_KERNEL)(function)  # type: ignore[no-any-return]


def entry(function: _Function) -> _Function:
    """Compile a function for calls from Python: cached on disk, and without the interpreter's lock.

    While another process compiles the same entry, this one waits for it and loads the result.
    """
    home = cache_directory(Path(function.__code__.co_filename))
    compiled = numba.njit(nogil=True, **_ENTRY)(function)
    if home is not None and not numba.config.DISABLE_JIT:
        whole_program.store(compiled, home)
        compiled.compile = _compiled_once(compiled, home / f"{function.__name__}.lock")
    return compiled  # type: ignore[no-any-return]


def _compiled_once(compiled: Any, lock: Path) -> Callable[..., object]:
    """A dispatcher's method ``compile``, in one process at a time."""
    compile_or_load = compiled.compile

    def compile_in_turn(signature: object) -> object:
        # numba's own lock first: two threads that each held one of the two would wait for ever
        with global_compiler_lock, one_process_at_a_time(lock):
            if at_compilation and not is_stored(compiled):
                for call in at_compilation:
                    call()
            return compile_or_load(signature)

    return compile_in_turn


def compile_for(compiled: Callable[..., object], *arguments: object) -> None:
    """Compile an entry for the types of arguments, or load it, without running it."""
    if hasattr(compiled, "py_func"):
        compiled.compile(tuple(map(numba.typeof, arguments)))  # type: ignore[attr-defined]


def is_stored(compiled: Callable[..., object]) -> bool:
    """Whether code of an entry is in the cache; always without a compiler, never without a cache."""
    function = getattr(compiled, "py_func", None)
    if function is None:
        return True
    home = cache_directory(Path(function.__code__.co_filename))
    # the code, not its index, which numba writes first
    return home is not None and any(home.glob(f"**/*.{function.__name__}-*.nbc"))


class ByAddress:
    """An entry that other compiled code calls by its address, without being compiled again as a part of it.

    Parameters
    ----------
    target : callable
        The entry.
    returns : numba type
        What it returns.

    Attributes
    ----------
    call : callable
        For compiled code: takes the address and a tuple of the arguments.
    """

    def __init__(self, target: Callable[..., object], returns: object) -> None:
        self._target, self._returns = target, returns
        self._has_address = whole_program.AVAILABLE and not numba.config.DISABLE_JIT
        call: Callable[..., Any]
        call = whole_program.caller(returns) if self._has_address else _called_directly(target)
        self.call = call

    def address(self, *arguments: object) -> int:
        """Address for arguments of the types that it will be called with; compiles it if need be."""
        return whole_program.address_of(self._target, arguments, self._returns) if self._has_address else 0


def _called_directly(target: Callable[..., object]) -> Callable[..., Any]:
    """An entry as compiled with whoever calls it, or not compiled."""

    @kernel
    def call(_address, arguments):  # type: ignore[no-untyped-def]
        return target(*arguments)

    return call
