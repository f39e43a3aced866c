"""Expressions in the notation of mathematics: a line of text, or LaTeX."""

from optuav.modelling.notation.latex import Latex
from optuav.modelling.notation.rules import Notation
from optuav.modelling.notation.text import Text

__all__ = ["Latex", "Notation", "Text"]
