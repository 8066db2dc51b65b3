"""The code that a worker runs: it has to be that of who asks."""

import hashlib
from functools import cache
from pathlib import Path


@cache
def package_digest() -> str:
    """Digest of all sources of this package."""
    home = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for source in sorted(home.rglob("*.py")):
        digest.update(f"{source.relative_to(home).as_posix()}\n".encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:20]
