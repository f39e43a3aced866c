"""A plan, its file, its summary and its trace."""

from optuav.network.timeline import Phase, PhaseStage
from optuav.plan.plan import Plan, Stop, load_plan

__all__ = ["Phase", "PhaseStage", "Plan", "Stop", "load_plan"]
