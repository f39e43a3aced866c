"""Models of which exactly one applies, joined into one model with a binary choice.

Every row of an alternative is stated once more from its own declaration. λ_r is 1 for the
alternative r that applies and 0 for the others; Σ λ_r = 1.

- ``"hull"``: each alternative has unknowns x_r of its own, and x = Σ x_r. A row a·x + c ≥ 0 becomes
  a·x_r + c λ_r ≥ 0, so that λ_r = 0 leaves x_r = 0. With λ_r in [0, 1] these rows describe the
  convex hull of all alternatives [1]_: no linear relaxation is tighter, and the best that it
  reaches is the best alternative itself, as long as nothing else ties the alternatives together.
- ``"big-M"``: the alternatives share the unknowns. A row a·x + c ≥ 0 becomes
  a·x + c ≥ −M (1 − λ_r), with M as small as bounds on the unknowns allow; those come from the rows
  whose coefficients are plain numbers, as a deadline's are. Fewer unknowns and rows, but a far
  looser relaxation: a little of each alternative slackens the rows of all of them [2]_.

References
----------
.. [1] E. Balas, "Disjunctive programming: properties of the convex hull of feasible points",
   Discrete Applied Mathematics, 1998.
.. [2] J. P. Vielma, "Mixed integer linear programming formulation techniques", SIAM Review, 2015.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from optuav.modelling.disjunction.big_m import BigM
from optuav.modelling.disjunction.cases import alike, case_of, shared_parameters
from optuav.modelling.disjunction.hull import Hull
from optuav.modelling.model import Model

Form = Literal["hull", "big-M"]
FORMS: tuple[Form, ...] = ("hull", "big-M")


class Disjunction(Model):
    """A joined model. Printed, what is alike for several alternatives is written once.

    Parameters
    ----------
    title
        What is sought, in a line.
    written
        The model to print.
    """

    def __init__(self, title: str, written: Model) -> None:
        super().__init__(title)
        self.written = written

    def __str__(self) -> str:
        return str(self.written)

    def to_latex(self) -> str:
        """The programme as a LaTeX ``align*`` environment, what is alike written once."""
        return self.written.to_latex()


def disjunction(
    alternatives: Mapping[str, Model], form: Form = "hull", *, relaxed: bool = False
) -> Disjunction:
    """One model in which exactly one of several linear models applies.

    Parameters
    ----------
    alternatives
        By name; all maximise or all minimise. Unknowns of the same name are the same, and one that
        an alternative does not have is 0 where it applies. Parameters of the same name and value
        are shared, others become ``name[k]`` for the alternative with number k, from 1.
    form
        ``"hull"`` or ``"big-M"``, see the module.
    relaxed
        Whether several alternatives may apply in part: 0 ≤ λ_r ≤ 1 instead of 0 or 1.

    Returns
    -------
    A model with the unknowns of the alternatives, a binary ``choice[k]`` for each, and in the form
    hull copies ``name[k]`` of its unknowns. The form hull holds for all values of the parameters;
    M is worked out for the signs that the coefficients have.

    Raises
    ------
    NotAffineError
        If an alternative is not linear.
    ValueError
        If the form does not exist, there is no alternative, or they disagree on the sense; in the
        form big-M also if an unknown has no bound that M could rest on, or objectives differ by
        more than a constant.
    """
    if form not in FORMS:
        raise ValueError(f"a disjunction has the form {' or '.join(FORMS)}, not {form!r}")
    if len({model.sense for model in alternatives.values()}) != 1:
        raise ValueError("a disjunction needs alternatives that all maximise or all minimise")
    shared = shared_parameters(list(alternatives.values()))
    cases = [
        case_of(str(number), name, model, shared)
        for number, (name, model) in enumerate(alternatives.items(), start=1)
    ]
    title = f"{cases[0].declared.title}; one of {len(cases)} alternatives"
    joined = Disjunction(title, Model(title))
    join = Hull if form == "hull" else BigM
    join(joined, cases, relaxed).state()
    join(joined.written, alike(cases), relaxed).state()
    return joined
