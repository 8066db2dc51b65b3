"""Messages of one step of reading, and the topic that they belong to."""

from collections.abc import Callable

import attrs
import numpy as np
from numpy.typing import NDArray


@attrs.frozen
class Channel:
    """Topic, type and schema of a channel in one file; unknown texts are empty."""

    topic: str
    type: str
    encoding: str
    definition: str
    definition_encoding: str


@attrs.frozen(eq=False)
class Piece:
    """Messages that are read in one step.

    Attributes
    ----------
    start_ns : int
        Lower bound of the log times in this piece and all later pieces of the file [ns].
    data : (bytes,) array of uint8
    messages : (n,) array of MESSAGE
    stored : int
        Bytes that the piece occupies in the file.
    """

    start_ns: int
    data: NDArray[np.uint8]
    messages: NDArray[np.void]
    stored: int


@attrs.frozen(eq=False)
class Due:
    """A piece that is not loaded yet, so that a merge of many files has few pieces in memory.

    Attributes
    ----------
    start_ns : int
        `Piece.start_ns` of the piece [ns].
    load : callable
        Returns the piece, or None if it is damaged. Call it before requesting the next piece.
    """

    start_ns: int
    load: Callable[[], Piece | None]
