"""Studies: many solves, one table; and programs in writing."""

from optuav.studies.choices import Choice, Choices, compare_by
from optuav.studies.comparison import Cell, Comparison, Method, Row
from optuav.studies.methods import compare
from optuav.studies.statement import statement

__all__ = [
    "Cell",
    "Choice",
    "Choices",
    "Comparison",
    "Method",
    "Row",
    "compare",
    "compare_by",
    "statement",
]
