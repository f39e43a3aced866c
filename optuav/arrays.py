"""Arrays by what they hold, of any shape; docstrings state shape and unit."""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
Integers: TypeAlias = npt.NDArray[np.intp]
Booleans: TypeAlias = npt.NDArray[np.bool_]
Values: TypeAlias = Mapping[str, Any]  # Numbers, or arrays with one entry a programme, by name
