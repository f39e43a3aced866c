"""Diagnosis: why this is the optimum, why there is none, and what would repair that."""

from optuav.diagnosis.certificate import Certificate
from optuav.diagnosis.explain import explain
from optuav.diagnosis.explanation import Explanation
from optuav.diagnosis.repair import Repair, repairs

__all__ = ["Certificate", "Explanation", "Repair", "explain", "repairs"]
