"""The two ways to compile: ``@kernel`` a formula, ``@entry`` what Python calls, cached and never stale."""

import ast
import hashlib
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import TypeVar

import numba

from leg_wear_monitor import whole_program
from leg_wear_monitor.code_cache import PACKAGE, code_directory

_Function = TypeVar("_Function", bound=Callable[..., object])

_ENTRY: dict[str, object] = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
_KERNEL = {**_ENTRY, "forceinline": True}

_HOME = Path(__file__).parent


def _module(parts: Iterable[str]) -> Path | None:
    """File of a module of this package; the parts of its name below the package."""
    place = _HOME.joinpath(*parts)
    files = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in files if file.is_file()), None)


@cache
def _imported(source: Path) -> frozenset[Path]:
    """Files of this package that a file of it imports by their full names."""
    found: set[Path | None] = set()
    for node in ast.walk(ast.parse(source.read_bytes())):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
            found.update(_module(name) for package, *name in names if package == PACKAGE)
        elif isinstance(node, ast.ImportFrom) and node.module:
            package, *name = node.module.split(".")
            if package == PACKAGE:
                # what is imported is a module itself, or something that stands in one
                found.update(_module([*name, alias.name]) or _module(name) for alias in node.names)
    return frozenset(file for file in found if file)


def _sources(roots: Iterable[Path]) -> set[Path]:
    """Files, and all of this package that they import, directly or not."""
    known: set[Path] = set()
    new = set(roots)
    while new:
        known |= new
        new = {source for known_one in new for source in _imported(known_one)} - known
    return known


def _digest(sources: Iterable[Path]) -> str:
    """What sources say, and where they lie."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(sources):
        digest.update(source.read_bytes())
        # numba compiles again for a file that lies elsewhere or is newer
        digest.update(f"{source} {source.stat().st_mtime_ns}".encode())
    return digest.hexdigest()[:16]


@cache
def cache_directory(root: Path | None = None) -> Path | None:
    """Directory of the compiled code of a file, named after its sources: what they say and where they lie.

    numba looks only at the file of the function it caches: a kernel that calls a kernel of another
    file would go on running its old body. A digest over the file and all that it imports closes that hole,
    and a home of its own makes the cache work where the package directory is read-only.

    Parameters
    ----------
    root : pathlib.Path, optional
        File of this package; all of the package's kernels if not given.

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
    """Compile a formula: numbers and arrays in, numbers out; division by zero gives inf, as in numpy.

    A kernel cannot allocate: without numba's runtime it counts no references either, which would cost more
    than the physics where many small arrays are passed around. It is compiled into the entry that calls
    it and not cached by itself: what comes out of a cache cannot be inlined.
    """
    if whole_program.AVAILABLE and not numba.config.DISABLE_JIT:
        return whole_program.KernelDispatcher(function, _KERNEL)
    return numba.njit(**_KERNEL)(function)  # type: ignore[no-any-return]


def entry(function: _Function) -> _Function:
    """Compile what Python calls: a kernel with a cache of its own, that lets other threads run meanwhile."""
    home, previous = cache_directory(Path(function.__code__.co_filename)), numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(home or previous)
    try:
        compiled = numba.njit(cache=home is not None, nogil=True, **_ENTRY)(function)
    finally:
        numba.config.CACHE_DIR = previous
    return compiled  # type: ignore[no-any-return]


@kernel
def copy_array(source, out):  # type: ignore[no-untyped-def]
    """Copy an array of one to three dimensions; numba's own slice assignment would allocate for it."""
    a, b = source.reshape(-1), out.reshape(-1)
    for i in range(b.shape[0]):
        b[i] = a[i]
