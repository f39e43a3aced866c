"""Optimisation models as trees of NumPy ufuncs, declared once and read by every engine."""

from optuav.modelling.check import Check, Checks, check
from optuav.modelling.declaration import Constraint
from optuav.modelling.expression import Expression, Let, Parameter, Relation, Variable
from optuav.modelling.forms import Affine, NotAffineError, affine
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate

__all__ = ["Affine", "Check", "Checks", "Constraint", "Expression", "Let", "Model"]
__all__ += ["NotAffineError", "Parameter", "Relation", "Variable", "affine", "check", "evaluate"]
__dir__ = __all__.copy
