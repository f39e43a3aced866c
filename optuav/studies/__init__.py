"""Studies: many solves, one table; and programs in writing."""

from optuav.studies.choices import Choice, Choices, compare_by
from optuav.studies.comparison import Cell, Comparison, Method, Row
from optuav.studies.methods import compare
from optuav.studies.schedules import Schedules, compare_schedules
from optuav.studies.statement import statement
from optuav.studies.uncertain.chances import Chances
from optuav.studies.uncertain.study import Sensitivity, sensitivity

__all__ = [
    "Cell",
    "Chances",
    "Choice",
    "Choices",
    "Comparison",
    "Method",
    "Row",
    "Schedules",
    "Sensitivity",
    "compare",
    "compare_by",
    "compare_schedules",
    "sensitivity",
    "statement",
]
