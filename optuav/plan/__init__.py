"""A plan, its file, its summary and its trace."""

from optuav.network.timeline import Phase, PhaseStage
from optuav.plan.data import Stop
from optuav.plan.plan import Plan, Plans, load_plan, load_plans, load_subject

__all__ = ["Phase", "PhaseStage", "Plan", "Plans", "Stop"]
__all__ += ["load_plan", "load_plans", "load_subject"]
