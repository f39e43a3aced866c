"""A plan, its file, its summary and its trace."""

from optuav.plan.file import load_plan
from optuav.plan.phases import Phase, Stage, Stop
from optuav.plan.plan import Plan

__all__ = ["Phase", "Plan", "Stage", "Stop", "load_plan"]
