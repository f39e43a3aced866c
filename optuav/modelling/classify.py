"""The kind of a model, found from its trees: linear, smooth, integer, and in how many unknowns."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from optuav.errors import for_console
from optuav.modelling.expression import Call, Operand
from optuav.modelling.forms import (
    NOWHERE,
    Exponential,
    NotExponentialError,
    Relaxation,
    exponential,
    not_linear,
    same_rate,
)
from optuav.modelling.model import Model
from optuav.modelling.traversal import KINKED, PARTIALS, has_unknowns

Flaw: TypeAlias = tuple[str, str]
"""Label of a constraint, or "objective", and its flaw with the reason."""


class Traits(NamedTuple):
    """Properties of a model."""

    unknowns: int  # Number of variables
    integer: bool = False  # Whether some variable is binary
    open_below: tuple[str, ...] = ()  # Symbols of the variables without a lower bound
    # Name of the first function that is not known to have derivatives everywhere; empty if there is
    # none. In only parameters, steps and kinks do no harm.
    rough: str = ""
    nonlinear: Flaw | None = None  # The first that is not affine in the variables
    # The unknown, of at most two ≥ 0, whose largest value it asks for, the other preferred small.
    longest: str = ""
    unlevelled: Flaw | None = None  # The first constraint without a form of times and levellings

    @property
    def linear(self) -> bool:
        """True if objective and constraints are affine in the variables."""
        return self.nonlinear is None

    @property
    def smooth(self) -> bool:
        """True if all functions are known to have derivatives everywhere."""
        return not self.rough

    @for_console
    def __str__(self) -> str:
        kind = "linear" if self.linear else "not smooth" if self.rough else "smooth"
        integer = ", some unknowns binary" if self.integer else ""
        plural = "" if self.unknowns == 1 else "s"
        return f"{kind}, {self.unknowns} unknown{plural}{integer}"


def traits(model: Model) -> Traits:
    """The kind of a model; found once, and again where the model has changed.

    Examples
    --------
    >>> from optuav.modelling import Model
    >>> from optuav.modelling.classify import traits
    >>> model = Model("an example")
    >>> x = model.variable("x", "x", unit="s", upper=5.0)
    >>> model.maximise(x)
    >>> print(traits(model))
    linear, 1 unknown
    >>> model.subject_to("curved", x * x <= 9.0)
    >>> traits(model).nonlinear
    ('curved', 'multiply of the unknowns is not linear')
    """
    walked, unknowns = model.walked, model.variables
    if isinstance(walked.traits, Traits):
        return walked.traits
    bounds = [
        unknown.lower if isinstance(unknown.lower, float) else math.nan for unknown in unknowns
    ]
    integer = any(unknown.binary for unknown in unknowns)
    from_0 = len(unknowns) <= 2 and all(bound == 0.0 for bound in bounds) and not integer
    pairs = zip(unknowns, bounds, strict=True)
    open_below = (variable.symbol for variable, bound in pairs if bound == -math.inf)
    calls = [node for node in walked.nodes if isinstance(node, Call)]
    if {call.ufunc for call in calls} <= PARTIALS.keys():
        calls = []
    rough = (c for c in calls if c.ufunc not in PARTIALS and (c.moves or c.ufunc not in KINKED))
    relations_by_label = [(row.label, row.relation.sides) for row in model.constraints]
    goals = [("objective", [model.objective]), ("preference", model.preferences)]
    nonlinear, unlevelled, done, relaxed = None, None, dict[int, Operand](), Relaxation()
    with np.errstate(all="ignore"):
        forms = walked.forms({})
        longest = _longest(model, forms) if from_0 else ""
        for label, trees in [*goals, *relations_by_label]:
            kinds = (forms.get(id(tree), NOWHERE) for tree in trees if has_unknowns(tree))
            if not all(kind.linear for kind in kinds if isinstance(kind, Exponential)):
                # The first nonlinear tree holds the first nonlinear term.
                nonlinear = label, not_linear(walked.nodes, forms)
                break
        if longest and len(forms) < len(walked.nodes):
            # Bounds will do in place of `Bounded` functions.
            done = {**forms}
            for label, sides in relations_by_label:
                try:
                    for side in sides:
                        exponential(side, {}, done, relaxed)
                except NotExponentialError as error:
                    unlevelled = label, str(error)
                    break
    if longest and unlevelled is None:
        unlevelled = _second_rate(relations_by_label, {**forms, **done})
    kind = len(unknowns), integer, tuple(open_below)
    kink = next((node.ufunc.__name__ for node in rough), "")
    walked.traits = result = Traits(*kind, kink, nonlinear, longest, unlevelled)
    return result


def _longest(model: Model, forms: Mapping[int, Operand]) -> str:
    """Name of the unknown of which a constant multiple is maximised, the other preferred small."""
    form = forms.get(id(model.objective), NOWHERE)
    if model.sense != "maximise" or not isinstance(form, Exponential) or not form.linear:
        return ""
    moving = {name: c for term, c in form.terms.items() for name, _ in term}
    if len(moving) != 1 or not np.all(np.asarray([*moving.values()]) > 0.0):
        return ""
    others = [unknown for unknown in model.variables if unknown.name not in moving]
    small = all(any(goal is other for other in others) for goal in model.preferences)
    return "".join(moving) * small


def _second_rate(
    stated: Sequence[tuple[str, Iterable[Operand]]], forms: Mapping[int, Operand]
) -> Flaw | None:
    """The first constraint where an unknown levels out at another rate than in one before."""
    rates: dict[str, Operand] = {}
    for label, sides in stated:
        for side in sides:
            form = forms.get(id(side))
            rates_of_side = form.rates_per_s if isinstance(form, Exponential) else {}
            for name, rate in rates_of_side.items():
                if not same_rate(rates.setdefault(name, rate), rate):
                    return label, f"{name} levels out at two rates"
    return None
