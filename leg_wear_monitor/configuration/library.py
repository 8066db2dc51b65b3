"""Files of one kind that come with the package, and a user's own ones beside them."""

from functools import cache
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration.nearest import did_you_mean
from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.configuration.yaml_file import read_document
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.share import share_directory


@attrs.frozen
class Library:
    """Files of a folder of ``config/``, called by name.

    Attributes
    ----------
    folder : str
    what : str
        One of them, in a word, for messages.
    kind : type
        Class that a file is structured as.
    """

    folder: str
    what: str
    kind: type

    def files(self) -> dict[str, Path]:
        """Files that come with the package, by name."""
        return dict(_files(share_directory() / "config" / self.folder))

    def unknown(self, name_or_path: str | Path) -> str:
        """Fault of a name that none of the files has; empty for a path, or a name that one has."""
        name, known = Path(name_or_path), self.files()
        if _is_path(name) or str(name) in known:
            return ""
        hint = did_you_mean(str(name), known)
        return f"no {self.what} of this name, leg-wear-monitor {self.folder} lists them{hint}"

    def load(self, name_or_path: str | Path) -> Any:
        """Read a file: by name, or by a path, which is anything with a suffix or a directory.

        Raises
        ------
        ConfigError
            Names file, key, value and what was expected.
        """
        path = Path(name_or_path)
        if _is_path(path):
            return _read(path, str(path), self.kind)
        fault = self.unknown(path)
        if fault:
            raise ConfigError(str(name_or_path), "", fault)
        return _shipped(self.files()[path.name], self.kind)


def _is_path(path: Path) -> bool:
    return bool(path.suffix) or path.parent != Path()


@cache
def _files(directory: Path) -> dict[str, Path]:
    return {path.stem: path for path in sorted(directory.glob("*.yaml"))}


@cache
def _shipped(path: Path, kind: type) -> Any:
    """A file of the package, which each joint of a leg asks for."""
    return _read(path, path.name, kind)


def _read(path: Path, source: str, kind: type) -> Any:
    try:
        document = read_document(path, source)
    except FileNotFoundError as error:
        raise ConfigError(source, "", f"cannot be read: {error.strerror}") from error
    return structure(document, kind, source, "")
