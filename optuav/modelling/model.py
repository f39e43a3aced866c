"""A model: labelled variables, parameters and constraints, and the objective."""

import math
import sys
from pathlib import Path
from types import FrameType
from typing import Any, Literal

from optuav.arrays import Values
from optuav.errors import InputError
from optuav.modelling.declaration import Constraint, Declaration
from optuav.modelling.display import latex, text
from optuav.modelling.expression import (
    Call,
    Expression,
    Let,
    Operand,
    Parameter,
    Relation,
    Variable,
)
from optuav.modelling.walk import Walk
from optuav.modelling.writer import LINE


class Model(Declaration):
    """An optimisation model as it was declared: it is solved elsewhere and holds no answer.

    Parameters
    ----------
    title
        The aim, in a line.

    Examples
    --------
    >>> from optuav.modelling import Model, Parameter, check
    >>> model = Model("longest hover from a full battery")
    >>> capacity = Parameter("capacity_As", "B", "A s", 36000.0)
    >>> drawn = Parameter("hover_current_A", "I", "A", 88.0)
    >>> hover = model.variable("hover_time_s", "Δ", unit="s", upper=600.0)
    >>> left = model.let("charge left", capacity - drawn * hover, symbol="y", unit="A s")
    >>> model.maximise(hover)
    >>> model.subject_to("reserve", left >= 0.05 * capacity, unit="A s", kind="state of charge")
    >>> print(model)
    longest hover from a full battery
    <BLANKLINE>
    maximise   Δ
    over       Δ ∈ [0, 600] s
    subject to
      reserve  y ≥ 0.05·B
    with
      charge left  y = B − I·Δ
    where
      B  capacity_As      36000  A s
      I  hover_current_A  88     A
    >>> check(model, {"hover_time_s": 400.0}).satisfied
    False
    """

    def variable(
        self,
        name: str,
        symbol: str,
        *,
        unit: str,
        lower: Operand = 0.0,
        upper: Operand = math.inf,
        label: str = "",
        first_slot: int = 0,
        binary: bool = False,
        kind: str = "",
    ) -> Variable:
        """Declare an unknown, see `Variable`; at least zero unless stated otherwise.

        `InputError` if its name or its symbol is taken.
        """
        if any(variable.name == name for variable in self.variables):
            raise InputError(f"the model has a variable {name!r} already")
        if any(variable.symbol == symbol for variable in self.variables):
            raise InputError(f"the model has a variable with the symbol {symbol!r} already")
        bounds, place = label or f"bounds of {symbol}", _place_of_caller()
        kinds = first_slot, binary, place, kind, bool(label)
        declared = Variable(name, symbol, unit, lower, upper, bounds, *kinds)
        self.variables.append(declared)
        return declared

    def let(
        self, name: str, expression: Operand, *, symbol: str = "", unit: str = "1", words: str = ""
    ) -> Let:
        """Give an intermediate quantity a name, so that the printed programme stays short.

        With words, they are printed instead of the expression. `InputError` if the name is taken.
        """
        if any(let.name == name for let in self.lets):
            raise InputError(f"the model has a quantity {name!r} already")
        named = Let(name, symbol or name, unit, expression, words)
        self.lets.append(named)
        return named

    def maximise(self, objective: Operand, *, unit: str = "") -> None:
        """State the quantity to maximise; `InputError` if an objective exists.

        A bare symbol gives the unit, unless it is stated.
        """
        self._aim("maximise", objective, unit)

    def minimise(self, objective: Operand, *, unit: str = "") -> None:
        """State the quantity to minimise; see `maximise`."""
        self._aim("minimise", objective, unit)

    def _aim(self, sense: Literal["maximise", "minimise"], objective: Operand, unit: str) -> None:
        if self.has_objective:
            already = f"the model {self.sense}s an objective already"
            raise InputError(f"{sense}: {already}; use one, such as a weighted sum of both")
        self.sense, self.sign = sense, 1.0 if sense == "maximise" else -1.0
        self.objective, self.has_objective = objective, True
        self.objective_unit = unit or getattr(objective, "unit", "")

    maximize, minimize = maximise, minimise

    def prefer_small(self, expression: Operand) -> None:
        """Among equally good answers, take one where this is smallest; earlier calls go first."""
        self.preferences.append(expression)

    def subject_to(
        self,
        label: str,
        relation: Relation,
        *,
        unit: str = "1",
        kind: str = "",
        step: int | None = None,
        moment: object = None,
    ) -> None:
        """Add a constraint under a label of its own; a moment is put behind it.

        See `optuav.modelling.Constraint`. `TypeError` if it compares no expressions, `InputError`
        if the label is taken or empty.
        """
        if not isinstance(relation, Relation):
            words = "with <=, >= or ==, not numbers, as T' = 0.0 without a rest"
            raise TypeError(f"{label}: a constraint compares expressions {words}")
        if not label.strip():
            raise InputError("a constraint needs a label, so that answers can name it")
        added = Constraint(label, relation, unit, _place_of_caller(), kind, step, moment)
        if any(constraint.label == added.label for constraint in self.constraints):
            raise InputError(f"the model has a constraint {added.label!r} already")
        self.constraints.append(added)

    def with_values(self, values: Values) -> "Model":
        """The same model with other values of its parameters, by name.

        Nodes are copied, which is faster than to declare them; named quantities in no constraint or
        objective stay this model's.
        """
        walk, new = self.walked, object.__new__
        twins = dict[int, Any]()  # Their copies for nodes and constraints, by identity
        for node in walk.nodes:
            twins[id(node)] = twin = new(type(node))
            twin.__dict__ |= node.__dict__
            if isinstance(node, Call):
                twin.arguments = tuple([twins.get(id(e), e) for e in node.arguments])
                twin.below = tuple([e for e in twin.arguments if isinstance(e, Expression)])
            elif isinstance(node, Let):
                twin.expression = twins.get(id(node.expression), node.expression)
                twin.below = (twin.expression,) if node.below else ()
            elif isinstance(node, Parameter):
                twin.value = values.get(node.name, node.value)
        for stated in self.constraints:
            (left, right), sense = stated.relation.sides, stated.relation.sense
            sides = twins.get(id(left), left), sense, twins.get(id(right), right)
            # `dataclasses.replace` takes ten times as long.
            twins[id(stated)] = twin = new(Constraint)
            twin.__dict__.update(stated.__dict__, relation=Relation(*sides))
        model = new(Model)
        model.__dict__ |= self.__dict__
        model.objective = twins.get(id(self.objective), self.objective)
        for name in ("preferences", "variables", "lets", "constraints"):
            vars(model)[name] = [twins.get(id(var), var) for var in vars(self)[name]]
        state, trees = ([twins.get(id(e), e) for e in some] for some in (walk.state, walk.trees))
        for variable in model.variables:
            low, high = variable.lower, variable.upper
            variable.lower, variable.upper = twins.get(id(low), low), twins.get(id(high), high)
        parameters = {name: twins[id(parameter)] for name, parameter in walk.given.items()}
        model._walk = Walk(state, trees, [twins[id(node)] for node in walk.nodes], parameters)
        return model

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the results of a walk, which depend on the identity of nodes."""
        return {**self.__dict__, "_walk": Walk([], [], [], {})}

    __str__ = text

    def _repr_html_(self) -> str:
        from optuav.modelling.mathml import html
        from optuav.presentation.markup import page

        return page(*html(self))

    def to_latex(self, *, width: int = LINE, numbers: bool = True, labels: bool = True) -> str:
        """The programme as LaTeX ``align*`` environments (package amsmath).

        Parameters
        ----------
        width
            About how many characters of mathematics a line has, 24 or more; by default as many as
            a column of an article holds, 36 for one of two.
        numbers
            Whether the values of the parameters follow.
        labels
            Whether lines have the names of constraints and keys as tags.

        Raises
        ------
        InputError
            If the width is not such a number.
        """
        return latex(self, width=width, numbers=numbers, labels=labels)

    _repr_latex_ = to_latex


def _place_of_caller() -> str:
    """File and line of the caller of a method, or of a ``declare`` on the way.

    Jupyter names the file of a cell by a number that nobody knows.
    """
    caller = sys._getframe(2)
    frame: FrameType | None = caller
    while frame is not None and frame.f_code.co_name != "declare":
        frame = frame.f_back
    frame = frame or caller
    file = Path(frame.f_code.co_filename)
    name = "cell" if file.parent.name.startswith("ipykernel_") else file.name
    return f"{name}:{frame.f_lineno}"
