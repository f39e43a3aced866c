"""Diagnosis: reasons for an optimum, reasons for no plan, and changes that would repair it."""

from optuav.diagnosis.explain import explain
from optuav.diagnosis.infeasibility import Certificate
from optuav.diagnosis.repair import Repair
from optuav.diagnosis.report import Explanation

__all__ = ["Certificate", "Explanation", "Repair", "explain"]
