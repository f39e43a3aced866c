"""Formulate and solve: a mission in, a checked plan out."""

from optuav.solving.program import Program
from optuav.solving.solve import formulate, solve

__all__ = ["Program", "formulate", "solve"]
