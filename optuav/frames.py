"""Tables as data frames of pandas, which is loaded when the first is made."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

from optuav.errors import require

if TYPE_CHECKING:
    import pandas

DataFrame: TypeAlias = "pandas.DataFrame"


ROUNDED_NUMBER = 1e-9  # Share of a size below which a number is only what rounding has left


def without_rounding(values: Any, size: float = 1.0) -> Any:
    """Return numbers as they are shown: 0 for what rounding has left beside numbers of a size."""
    import numpy as np  # not where a mission is only read

    return np.where(np.abs(values) <= ROUNDED_NUMBER * size, 0.0, values)


def frame(
    data: Mapping[str, Any] | Iterable[Any], columns: list[str] | tuple[str, ...] | None = None
) -> DataFrame:
    """Columns by name, or rows under the names of columns, as a data frame.

    Raises `InputError` where pandas is not installed.
    """
    require("pandas", "data frames")
    import pandas

    table = data if isinstance(data, Mapping) else [*data]
    return pandas.DataFrame(table, columns=columns)
