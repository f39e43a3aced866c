"""Buildings of a city from map files; they need geopandas (``python -m pip install geopandas``)."""

from optuav.errors import require

require("geopandas", "cities")

from optuav.city.city import City
from optuav.city.read import read

__all__ = ["City", "read"]
__dir__ = __all__.copy
