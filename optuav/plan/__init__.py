"""A plan and its files."""

from optuav.plan.file import load_plan
from optuav.plan.plan import Phase, Plan, Stage, Stop

__all__ = ["Phase", "Plan", "Stage", "Stop", "load_plan"]
