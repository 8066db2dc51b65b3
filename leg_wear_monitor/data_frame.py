"""Tables as pandas has them; pandas is wanted only by whoever asks for one."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from leg_wear_monitor.errors import LegWearError

if TYPE_CHECKING:
    import pandas as pd


def data_frame(columns: Mapping[str, Any], index: str | list[str] | None = None) -> "pd.DataFrame":
    """Columns of equal length as a data frame.

    Parameters
    ----------
    columns : mapping of str to sequence
    index : str or list of str, optional
        Columns that name the rows.

    Raises
    ------
    LegWearError
        If pandas is not installed.
    """
    try:
        import pandas as pd
    except ModuleNotFoundError as error:
        raise LegWearError("tables need pandas, which is not installed; pip install pandas") from error
    frame = pd.DataFrame(dict(columns))
    return frame if index is None else frame.set_index(index)
