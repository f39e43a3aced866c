"""A plan, its file, its summary and its trace."""

from optuav.network.timeline import Phase, PhaseStage
from optuav.plan.file import load_plan
from optuav.plan.plan import Plan, Stop

__all__ = ["Phase", "PhaseStage", "Plan", "Stop", "load_plan"]
