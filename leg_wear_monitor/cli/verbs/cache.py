"""``leg-wear-monitor cache``: compiled code on this machine."""

import shutil
from datetime import datetime
from pathlib import Path

import click

from leg_wear_monitor.errors import LegWearError

_MOST = 20  # directories that are listed: one version has about ten


@click.command(short_help="List or remove the compiled code on this machine.")
@click.option("--clear", is_flag=True, help="Remove it; the next start compiles again.")
def cache(clear: bool) -> None:
    """Print the place and the size of the compiled code, by version; or remove it.

    Each change of the source makes a new version. The two versions that were used last are kept, and all
    versions that were used within a day.
    """
    from leg_wear_monitor.code_cache import kept_directories
    from leg_wear_monitor.kernel import cache_directory

    here = cache_directory()
    if here is None:
        raise LegWearError("no directory is safe for compiled code, so it is not stored")
    kept = kept_directories(here.parent)
    click.echo(f"place: {here.parent}")
    if clear:
        size = sum(map(_size, kept))
        for directory in kept:
            shutil.rmtree(directory, ignore_errors=True)
        left = [each for each in kept if each.exists()]
        if left:
            raise LegWearError(f"{left[0]} could not be removed, nor {len(left) - 1} more")
        click.echo(f"removed: {_in_mb(size)} in {len(kept)} directories")
        return
    click.echo(f"total: {_in_mb(sum(map(_size, kept)))} in {len(kept)} directories")
    for directory in sorted(kept, key=_used, reverse=True)[:_MOST]:
        used = datetime.fromtimestamp(_used(directory)).strftime("%Y-%m-%d %H:%M")
        click.echo(f"  {_in_mb(_size(directory)):>9}  used {used}  {directory.name}")
    if len(kept) > _MOST:
        click.echo(f"  and {len(kept) - _MOST} that are older")


def _used(directory: Path) -> float:
    return directory.stat().st_mtime


def _size(directory: Path) -> int:
    return sum(file.stat().st_size for file in directory.rglob("*") if file.is_file())


def _in_mb(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
