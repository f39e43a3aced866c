"""Why a program is infeasible, or its optimum the best: proofs that a reader can check by hand.

The rows a·x ≤ b of a linear programme, each times a multiplier y ≥ 0, add up to a consequence
(Σ y a)·x ≤ Σ y b. Farkas: a programme is infeasible exactly if some sum reads 0 ≤ something
negative. Duality: an optimum is proved by a sum that bounds the objective by it. The numbers are
the exact rational values of the floats in the programme [1]_. Constraints that are not linear come
as irreducible sets that cannot hold together, route by route, by the deletion filter [2]_.

References
----------
.. [1] A. Schrijver, "Theory of linear and integer programming", Wiley, 1986, chapter 7.
.. [2] J. W. Chinneck, "Feasibility and infeasibility in optimization", Springer, 2008.
.. [3] R. G. Bland, "New finite pivoting rules for the simplex method", Mathematics of Operations
   Research, 1977.
"""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, is_dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from formulations.parameters import QUANTITIES
from formulations.soc import LABELS
from optuav.arrays import Values
from optuav.engines import bracket
from optuav.engines.linear_form import linear_form
from optuav.errors import InputError, for_console
from optuav.modelling import Model, NotAffineError
from optuav.modelling.check import evaluated, relations
from optuav.modelling.classify import traits
from optuav.modelling.declaration import Constraint
from optuav.modelling.expression import Parameter
from optuav.modelling.forms import NotExponentialError, excess
from optuav.modelling.traversal import leaves
from optuav.presentation.numbers import figure
from optuav.solving import Program
from optuav.solving.constraint_words import constraint_words, moments, violation, words
from optuav.solving.no_plan import subset
from optuav.solving.route_models import RouteModel

ZERO = Fraction(0)
LEAST_VIOLATION = Fraction(1, 10**11)
"""Violation by rounding that counts as no conflict, relative to max(1, |limit|)."""
MOST_ROUTES = 100
"""Routes of a declaration whose conflicts are examined: those with the shortest flights."""
FAR_S = 1e4  # How far times are followed where no constraint bounds them [s]

Coefficients = Mapping[str, Fraction]  # By symbol of the unknown, exact, without zeros


@dataclass(frozen=True)
class Row:
    """A constraint as a row Σ coefficient · unknown ≤ limit, with its multiplier in a sum."""

    label: str
    parameters: tuple[str, ...]  # Names of those in the constraint
    keys: tuple[str, ...]  # Their keys of the mission
    coefficients: Coefficients
    limit: Fraction
    multiplier: Fraction = ZERO


@dataclass(frozen=True)
class Certificate:
    """Constraints added up, each times its multiplier; none of the rows can be spared.

    Parameters
    ----------
    rows
        The constraints that are used.
    objective
        The maximised objective, by symbol of the unknown, if the sum objective ≤ limit proves that
        no point is better; empty if the sum 0 ≤ something negative proves that no point exists.

    Examples
    --------
    >>> import optuav
    >>> late = optuav.load("paper").replace({"limits.deadline_s": 60})
    >>> part = optuav.formulate(late, "P3", perspective="battery").parts[0]
    >>> (certificate,) = certificates(part.model, part.model.row(0))
    >>> certificate.holds(), certificate.keys
    (True, ('limits.deadline_s',))
    >>> print(certificate)
    1 ×  P3.b hover time  −Δ ≤ 0
    1 ×  P3.b hover time  Δ ≤ −15.7922
    sum  0 ≤ −15.7922, which is false
    """

    rows: tuple[Row, ...]
    objective: Coefficients = field(default_factory=dict)

    @property
    def coefficients(self) -> Coefficients:
        """Σ y a."""
        sums = dict[str, Fraction]()
        for row in self.rows:
            for symbol, factor in row.coefficients.items():
                sums[symbol] = sums.get(symbol, ZERO) + row.multiplier * factor
        return {symbol: value for symbol, value in sums.items() if value}

    @property
    def limit(self) -> Fraction:
        """Σ y b."""
        return sum((row.multiplier * row.limit for row in self.rows), ZERO)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the constraints, each once."""
        return tuple(dict.fromkeys(row.label for row in self.rows))

    @property
    def keys(self) -> tuple[str, ...]:
        """The mission's keys in them, each once."""
        return tuple(dict.fromkeys(key for row in self.rows for key in row.keys))

    def holds(self) -> bool:
        """Return whether the rows are a proof, evaluated exactly."""
        added = bool(self.rows) and all(row.multiplier >= 0 for row in self.rows)
        proves = bool(self.objective) or self.limit < 0
        return added and proves and self.coefficients == self.objective

    @property
    def table(self) -> list[tuple[str, str, str]]:
        """Multipliers, labels and rows as text with six digits, and their sum."""
        rows = [
            (f"{figure(e.multiplier)} ×", e.label, _inequality(e.coefficients, e.limit))
            for e in self.rows
        ]
        verdict = "" if self.objective else ", which is false"
        return [*rows, ("sum", "", _inequality(self.coefficients, self.limit) + verdict)]

    __str__ = for_console(lambda self: "\n".join("  ".join(filter(None, x)) for x in self.table))

    def to_dict(self) -> dict[str, object]:
        """Return plain data; every number exact, ``"numerator/denominator"``, and rounded."""
        total = {"coefficients": self.coefficients, "limit": self.limit}
        content = {"labels": self.labels, "keys": self.keys, "rows": self.rows, "sum": total}
        return {"holds": self.holds(), **plain(content)}


def plain(value: object) -> Any:
    """Plain data: text, finite numbers or None, lists and dicts; fractions exact and rounded."""
    if isinstance(value, Fraction):
        return {"exact": str(value), "rounded": float(value)}
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, tuple | list):
        return [plain(element) for element in value]
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if is_dataclass(value):
        return {part.name: plain(getattr(value, part.name)) for part in fields(value) if part.repr}
    return value.item() if isinstance(value, np.generic) else value


def _inequality(coefficients: Coefficients, limit: Fraction) -> str:
    terms: list[str] = []
    for symbol, factor in coefficients.items():
        size = symbol if abs(factor) == 1 else f"{figure(abs(factor))}·{symbol}"
        sign = "−" if factor < 0 else "+"
        terms.append(f"{sign} {size}" if terms else f"{sign}{size}".removeprefix("+"))
    return f"{' '.join(terms) or '0'} ≤ {figure(limit)}"


def certificates(
    model: Model, parameters: Values, slot_s: float | None = None
) -> Iterator[Certificate]:
    """Minimal conflicts of linear constraints; no two share a constraint on parameters.

    A repair must resolve all of them, and others may appear. Among constraints without unknowns
    the first that is violated is named; those that are not linear are left out. In slots the
    unknowns take at least their first slot, but not only whole ones.
    """
    rows = inequalities(linear_part(model), parameters, slot_s)
    symbols = [variable.symbol for variable in model.variables]
    while True:
        columns = [_column(row, symbols, LEAST_VIOLATION) for row in rows]
        weights = combination(columns, [ZERO] * len(symbols) + [Fraction(-1)])
        if weights is None:
            return
        used = [row for row, weight in zip(rows, weights, strict=True) if weight]
        first, *_ = positive = [*filter(None, weights)]  # only the ratios count
        scaled = zip(used, positive, strict=True)
        yield Certificate(tuple(replace(row, multiplier=y / first) for row, y in scaled))
        named = [row for row in used if row.parameters] or used
        rows = [row for row in rows if not any(row is other for other in named)]
        if not all(row.coefficients for row in used):
            rows = [row for row in rows if row.coefficients]


def bound(model: Model, parameters: Values, binding: Collection[str]) -> Certificate | None:
    """Rows among the binding ones that add up to the objective: no point is better.

    A minimised objective is negated. None if no rows do, none are needed, or one is not linear.
    """
    if not traits(model).linear:
        return None
    symbols = [variable.symbol for variable in model.variables]
    goal = [Fraction(float(x)) for x in linear_form(model, parameters).directions[0, :, 0]]
    rows = [row for row in inequalities(model, parameters) if row.label in binding]
    weights = combination([_column(row, symbols)[:-1] for row in rows], goal)
    if not weights or not any(weights):
        return None
    used = (replace(row, multiplier=y) for row, y in zip(rows, weights, strict=True) if y)
    return Certificate(tuple(used), {s: x for s, x in zip(symbols, goal, strict=True) if x})


def linear_part(model: Model) -> Model:
    """The model with only its linear constraints, and no objective."""
    linear = list[Constraint]()
    for constraint in model.constraints:
        with suppress(NotAffineError):
            excess(constraint.relation, {})
            linear.append(constraint)
    return subset(model, linear)


def parameters_in(constraint: Constraint) -> tuple[Parameter, ...]:
    """The parameters in a constraint."""
    return tuple(leaf for leaf in leaves(*constraint.relation.sides) if isinstance(leaf, Parameter))


def is_own(parameter: Parameter) -> bool:
    """Return whether a user's formulation adds a parameter that no quantity of a mission is."""
    name = parameter.name.partition("[")[0]  # One of several devices has a number after it
    ours = parameter.key or name in {quantity.name for quantity in QUANTITIES}
    return parameter.varies and not ours


def inequalities(model: Model, parameters: Values, slot_s: float | None = None) -> list[Row]:
    """The rows of a linear programme that limit something; an infinite limit does not."""
    form = linear_form(model, parameters)
    symbols = [variable.symbol for variable in model.variables]
    # An equality gives two rows of the linear form.
    constraints = [relation for relation in relations(model) for _ in relation.relation.signs]
    rows, normals, limits = [], form.normals[..., 0].tolist(), form.limits[:, 0].tolist()
    for constraint, normal, limit in zip(constraints, normals, limits, strict=True):
        if np.isfinite([*normal, limit]).all():
            numbers = zip(symbols, map(Fraction, normal), strict=True)
            factors = {symbol: factor for symbol, factor in numbers if factor}
            named = parameters_in(constraint)
            names, keys = tuple(p.name for p in named), tuple(e.key for e in named if e.key)
            rows.append(Row(constraint.label, names, keys, factors, Fraction(limit)))
    for variable in model.variables:
        if slot_s is not None and variable.first_slot > 0:
            symbol, least_s = variable.symbol, Fraction(variable.first_slot * slot_s)
            rows.append(Row(f"first slot of {symbol}", (), (), {symbol: Fraction(-1)}, -least_s))
    return rows


def _column(row: Row, symbols: Sequence[str], allowance: Fraction = ZERO) -> list[Fraction]:
    """(a, b) of a row, with a relative allowance on b."""
    limit = row.limit + allowance * max(Fraction(1), abs(row.limit))
    return [*(row.coefficients.get(symbol, ZERO) for symbol in symbols), limit]


def combination(
    vectors: Sequence[Sequence[Fraction]], target: Sequence[Fraction]
) -> list[Fraction] | None:
    """Exact multipliers y ≥ 0 with Σ y_k vector_k = target; None if none exist.

    The vectors that carry weight are linearly independent, so none of them can be spared. Phase one
    of the simplex method, with Bland's rule against cycling [3]_.
    """
    count = len(vectors)
    rows = [
        [Fraction(-1 if wanted < 0 else 1) * x for x in (*(v[k] for v in vectors), wanted)]
        for k, wanted in enumerate(target)
    ]
    basis = [count + k for k in range(len(rows))]  # at first the shortfall of each target
    # The last row is the sum of the others: the total shortfall.
    rows.append([sum(column, ZERO) for column in zip(*rows, strict=True)])
    while rows[-1][count] > 0:
        entering = next((j for j in range(count) if rows[-1][j] > 0), None)
        if entering is None:
            return None
        rising = [(k, row) for k, row in enumerate(rows[:-1]) if row[entering] > 0]
        *_, leaving = min((row[count] / row[entering], basis[k], k) for k, row in rising)
        basis[leaving] = entering
        pivot = [x / rows[leaving][entering] for x in rows[leaving]]
        rows = [[x - r[entering] * y for x, y in zip(r, pivot, strict=True)] for r in rows]
        rows[leaving] = pivot
    multipliers = dict(zip(basis, (row[count] for row in rows), strict=False))
    return [multipliers.get(column, ZERO) for column in range(count)]


@dataclass(frozen=True)
class Clash:
    """Constraints that no times satisfy together, but some do if any one of them is left out."""

    labels: tuple[str, ...]
    keys: tuple[str, ...]  # The mission's keys in them
    broken: tuple[str, ...]  # Sentences on those that do not hold without any stay, Δ = T' = 0
    far_s: float  # Largest sum of times with a proof [s]; infinity if they are bounded


@dataclass(frozen=True)
class Conflict:
    """Why some routes have no feasible times.

    All certificates must be resolved. Without any the linear constraints agree; then there is a
    clash, or only whole slots do not fit, or no engine can tell.
    """

    route: tuple[str, ...]  # Places of the route with the shortest flight of those concerned
    routes: int  # Number of routes concerned
    certificates: tuple[Certificate, ...] = ()  # Conflicts of linear constraints on that route
    clash: Clash | None = None

    @property
    def proofs(self) -> tuple[Certificate | Clash, ...]:
        """Certificates and clash."""
        return (*self.certificates, self.clash) if self.clash else self.certificates

    def to_dict(self) -> dict[str, object]:
        """Return plain data."""
        proofs = {"conflicts": plain(self.certificates), "clash": plain(self.clash)}
        return {"route": list(self.route), "routes": self.routes, **proofs}


def conflicts(program: Program) -> tuple[Conflict, ...]:
    """The conflicts of an infeasible program; shared ones appear once."""
    return tuple(conflict for part in program.parts for conflict in _of_part(program, part))


def _of_part(program: Program, part: RouteModel) -> Iterator[Conflict]:
    """Conflicts on the routes of a declaration, those with the shortest flights first."""
    network = program.network
    flight_s = network.routes.flight_time_s[part.routes]
    alike: dict[tuple[tuple[str, ...], ...], list[tuple[int, list[Certificate]]]] = {}
    for entry in np.argsort(flight_s, kind="stable")[:MOST_ROUTES].tolist():
        proofs = [*certificates(part.model, part.model.row(entry), program.question.slot_s)]
        alike.setdefault(tuple(proof.labels for proof in proofs), []).append((entry, proofs))
    unproved = [entry for entry, _ in alike.pop((), [])]
    for (first, proofs), *others in alike.values():
        named = []
        for proof in proofs:
            labels = words(network, part, first, [row.label for row in proof.rows])
            rows = map(lambda row, label: replace(row, label=label), proof.rows, labels)
            named.append(Certificate(tuple(rows)))
        names = network.route_names(part.routes[first])
        yield Conflict(names, 1 + len(others), tuple(named))
    if unproved and traits(part.model).linear:
        yield Conflict(network.route_names(part.routes[unproved[0]]), len(unproved))
    elif unproved:
        yield from _clashes(program, part, unproved)


def _clashes(program: Program, part: RouteModel, entries: Sequence[int]) -> Iterator[Conflict]:
    """Conflicts of constraints that are not linear: of one route, and of all that share it."""
    model, left = part.model, [*entries]
    while left:
        first, names = left[0], program.network.route_names(part.routes[left[0]])
        try:
            meeting = _irreducible(model, model.row(first))
            shared = bracket.some_point(subset(model, meeting, FAR_S), len(part.routes))[1]
        except (NotExponentialError, InputError):
            yield Conflict(names, len(left))
            return
        others = [entry for entry in left[1:] if not shared[entry]]
        yield Conflict(names, len(left) - len(others), clash=_clash(program, part, first, meeting))
        left = others


def _irreducible(model: Model, parameters: Values) -> tuple[Constraint, ...]:
    """One set of constraints that cannot hold together, and none can be spared.

    Nothing is feasible with the parameters, which are numbers. `NotExponentialError` if a
    constraint has a form that phases of constant current do not have.
    """
    linear = linear_part(model).constraints
    kept = [*(constraint for constraint in model.constraints if constraint not in linear), *linear]
    for candidate in kept[::-1]:
        fewer = [other for other in kept if other is not candidate]
        if fewer and bracket.some_point(subset(model, fewer, FAR_S), 1, parameters)[1][0]:
            kept = fewer
    return tuple(constraint for constraint in model.constraints if constraint in kept)


def _clash(program: Program, part: RouteModel, entry: int, meeting: Sequence[Constraint]) -> Clash:
    """A clash with labels and moments by the places of the route."""
    network, model, row = program.network, part.model, part.model.row(entry)
    labels = tuple(words(network, part, entry, [constraint.label for constraint in meeting]))
    moment_of = moments(network, part, entry)
    sides = evaluated(meeting, {**row, **{variable.name: 0.0 for variable in model.variables}})
    broken = []
    for label, side in zip(labels, sides, strict=True):
        moment, kind = moment_of.get(side.label), side.constraint.kind
        of_well = f"the available well would be {kind} {moment}"
        compared = f"{constraint_words(label)}: {violation(side)} would be false"
        if not side.satisfied:
            broken.append(of_well if moment and kind in LABELS else compared)
    keys = dict.fromkeys(p.key for one in meeting for p in parameters_in(one) if p.key)
    far_s = FAR_S
    with suppress(InputError):  # the times are not bounded
        if bracket.some_point(subset(model, meeting), 1, row)[1].all():
            far_s = math.inf
    return Clash(labels, tuple(keys), tuple(broken), far_s)
