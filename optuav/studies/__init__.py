"""Studies: many solves, one table; and programs in writing."""

from optuav.studies.choices import Choice, Choices, compare_by
from optuav.studies.comparison import Cell, Comparison, Method, Row
from optuav.studies.methods import compare
from optuav.studies.statement import statement
from optuav.studies.uncertain.study import Chances, Sensitivity, sensitivity

__all__ = [
    "Cell",
    "Chances",
    "Choice",
    "Choices",
    "Comparison",
    "Method",
    "Row",
    "Sensitivity",
    "compare",
    "compare_by",
    "sensitivity",
    "statement",
]
