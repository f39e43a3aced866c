"""Diagnosis: why a plan is optimal, why there is none, and which changes would repair that."""

from optuav.diagnosis.explain import explain
from optuav.diagnosis.infeasibility import Certificate
from optuav.diagnosis.repair import Repair
from optuav.diagnosis.report import Explanation

__all__ = ["Certificate", "Explanation", "Repair", "explain"]
