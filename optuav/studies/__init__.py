"""Studies: many solves, one table."""

from optuav.studies.choices import Choice, Choices, compare_by
from optuav.studies.compare import compare
from optuav.studies.comparison import Cell, Comparison, Method, Row

__all__ = ["Cell", "Choice", "Choices", "Comparison", "Method", "Row", "compare", "compare_by"]
