"""The two ways to compile: ``@kernel`` a formula, ``@entry`` what Python calls, cached and never stale."""

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TypeVar

import numba

_Function = TypeVar("_Function", bound=Callable[..., object])


def _writable(directory: Path) -> bool:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(directory, os.W_OK | os.X_OK)


@cache
def cache_directory() -> Path:
    """Directory of the compiled code, named after its sources: what they say and where they lie.

    numba looks only at the file of the function it caches: a kernel that calls a kernel of another
    file would go on running its old body. A digest over the sources of all kernels closes that hole,
    and a home of its own makes the cache work where the package directory is read-only.

    Returns
    -------
    pathlib.Path
        ``$NUMBA_CACHE_DIR`` if set, else below ``$XDG_CACHE_HOME`` or ``~/.cache``, else below the
        temporary directory.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        text = source.read_bytes()
        if b"leg_wear_monitor.kernel" in text or b"NamedTuple" in text:
            digest.update(text)
            # numba compiles again for a file that lies elsewhere or is newer
            digest.update(f"{source} {source.stat().st_mtime_ns}".encode())
    leaf = f"leg_wear_monitor/{digest.hexdigest()[:16]}"
    homes = [
        os.environ.get("NUMBA_CACHE_DIR"),
        os.environ.get("XDG_CACHE_HOME"),
        os.path.expanduser("~/.cache"),
    ]
    for home in homes:
        if home and _writable(Path(home) / leaf):
            return Path(home) / leaf
    return Path(tempfile.gettempdir()) / f"leg_wear_monitor-{os.getuid()}" / leaf


def kernel(function: _Function) -> _Function:
    """Compile a formula: numbers and arrays in, numbers out; division by zero gives inf, as in numpy.

    A kernel cannot allocate: without numba's runtime it counts no references either, which would cost more
    than the physics where many small arrays are passed around. It is compiled into the entry that calls
    it and not cached by itself: what comes out of a cache cannot be inlined.
    """
    return numba.njit(error_model="numpy", _nrt=False, forceinline=True)(function)  # type: ignore[no-any-return]


def entry(function: _Function) -> _Function:
    """Compile what Python calls: a kernel with a cache of its own, that lets other threads run meanwhile."""
    previous = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(cache_directory())
    try:
        return numba.njit(cache=True, error_model="numpy", _nrt=False, nogil=True)(function)  # type: ignore[no-any-return]
    finally:
        numba.config.CACHE_DIR = previous


@kernel
def copy_array(source, out):  # type: ignore[no-untyped-def]
    """Copy an array of one to three dimensions; numba's own slice assignment would allocate for it."""
    a, b = source.reshape(-1), out.reshape(-1)
    for i in range(b.shape[0]):
        b[i] = a[i]
