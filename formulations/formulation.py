"""The Formulation base class, and the itinerary quantities it receives as symbols."""

import math
import operator
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from functools import lru_cache, reduce
from typing import Any, Self

import numpy as np

from formulations.parameters import QUANTITIES, Covered, Hover, Landing, Quantities
from formulations.soc import (
    AVAILABLE,
    LABELS,
    STAYS,
    landing_moments,
    soc_after,
    soc_on_landing,
    well_limits,
)
from optuav.arrays import Values
from optuav.errors import InputError, nearest
from optuav.modelling import Expression, Model, Parameter, Variable
from optuav.modelling.expression import Indexed, Operand, Share
from optuav.modelling.forms import NotAffineError, affine
from optuav.modelling.traversal import has_unknowns, leaves
from optuav.options import Order, Perspective, Trajectory
from optuav.physics.kibam import Stage


@dataclass(frozen=True, kw_only=True)
class Given(Quantities):
    """The quantities of an itinerary as named parameters, for use in `Formulation.declare`."""

    perspective: Perspective  # How the state of charge is written
    _others: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    def __getattr__(self, name: str) -> Any:
        """Another number of the mission or of its routes, see `Quantities.numbers`."""
        if name.startswith("_"):
            raise AttributeError(name)
        if isinstance(key := (others := self._symbols()).get(name), str):
            raise AttributeError(f"given has no {name!r}: the mission does not set {key}")
        if name not in others:
            options_of = [name for name in dir(type(self)) if not name.startswith("_")]
            hint = nearest(
                name, [*others, *options_of, *(quantity.name for quantity in QUANTITIES)]
            )
            if name == "hover_position_m" and self.covered:
                hint = ": which of the several devices? Each hovers at a place of its own."
            if name.startswith("rest_") and not self.rests:
                hint = " on a route without a rest: ask for it under 'if given.rests:'."
            words = "Name a number of the mission by its table and key, such as laser_power_W"
            raise AttributeError(f"given has no {name!r}{hint or '.'} {words}")
        return others[name]

    def __dir__(self) -> list[str]:
        names = (name for name, symbol in self._symbols().items() if not isinstance(symbol, str))
        return [*super().__dir__(), *names]

    def _symbols(self) -> Mapping[str, Any]:
        """The mission's other numbers as parameters, of a vector three; made once.

        A number that the mission does not state is the name of its key.
        """
        same = {quantity.metadata["key"]: getattr(self, quantity.name) for quantity in QUANTITIES}
        for name, (value, unit, key) in () if self._others else self.numbers().items():
            stem, _, axis = name.partition("[")
            single = f"{stem}_{'xyz'[int(axis[0])]}" if axis else stem
            if value is None:
                self._others[stem] = key.partition("[")[0]
                continue
            if (symbol := same.get(key) if key else None) is None:
                symbol = Parameter(single, key or single, unit, value, key)
            self._others[stem] = (*self._others.get(stem, ()), symbol) if axis else symbol
        return self._others

    @classmethod
    def of(cls, quantities: Quantities, perspective: Perspective) -> Self:
        """Symbols for the numbers of some itineraries; without a rest, its figures are 0."""
        names = (quantity.name for quantity in fields(Quantities) if quantity.init)
        symbols = {name: getattr(quantities, name) for name in names}
        for name, metadata in ((quantity.name, quantity.metadata) for quantity in QUANTITIES):
            if symbols[name] is not None:
                symbols[name] = Parameter(name, value=symbols[name], **metadata)
        symbols |= {} if quantities.rests else dict.fromkeys(STAYS["rest"], 0.0)
        steps = [*quantities.steps]
        for n, step in enumerate(steps, start=1):
            if not isinstance(step, str):
                named = [
                    Parameter(f"step_{n}_{k}", f"{sign}_{n}", unit, value, varies=False)
                    for k, sign, unit, value in zip(Stage._fields, "It", "As", step, strict=True)
                ]
                steps[n - 1] = Stage(*named)
        symbols |= {"steps": tuple(steps), "landings": named_landings(quantities.landings)}
        symbols |= {"hovers": tuple(named_hovers(quantities.hovers))}
        symbols |= {"covered": tuple(named_covered(quantities.covered))}
        return cls(**symbols, perspective=perspective)

    def hover_and_rest(self, model: Model) -> tuple[Variable, Operand]:
        """Declare Δ and, where the route goes by way of a building, T'; else T' is 0.0.

        Of equally good plans the one with the shortest rest is preferred.
        """
        if not self.rests:
            return model.variable("hover_time_s", "Δ", unit="s"), 0.0
        hover = model.variable("hover_time_s", "Δ", unit="s", first_slot=1)
        rest = model.variable("rest_time_s", "T'", unit="s", first_slot=1)
        model.prefer_small(rest)
        return hover, rest

    def keep_deadline(self, model: Model, label: str, hover: Operand, rest: Operand = 0.0) -> None:
        """State Δ + T' ≤ T_max − T_fl.

        Without a rest the time left becomes the upper bound of Δ itself, if that is an unknown, so
        that its last slot may be cut short.
        """
        lasts, left = isinstance(rest, Expression) or bool(np.any(rest)), self.time_left
        is_open = isinstance(hover, Variable) and isinstance(hover.upper, float)
        if is_open and math.isinf(hover.upper) and not lasts and not has_unknowns(left):
            hover.upper, hover.label, hover.kind, hover.labelled = left, label, "deadline", True
        else:
            stay = hover + rest if lasts else hover
            model.subject_to(label, stay <= left, unit="s", kind="deadline")

    def soc_end(self, hover: Operand, rest: Operand = 0.0) -> Operand:
        """State of charge at the end [-] after hovering and resting [s], by the perspective.

        A stay of 0.0 s adds no terms.
        """
        return soc_after(self, self.perspective, hover, rest)

    def keep_charge(self, model: Model, label: str, hover: Operand, rest: Operand = 0.0) -> None:
        """State that at least η0 is left at the end, and at every landing if the mission says so.

        The mission's key is ``limits.keep_soc``.
        """
        end = self.soc_end(hover, rest) >= self.min_soc
        model.subject_to(label, end, kind="state of charge")
        for landing, moment in zip(self.landings, landing_moments(self), strict=True):
            left = soc_on_landing(self, self.perspective, landing, hover, rest) >= self.min_soc
            model.subject_to(label, left, kind="state of charge", moment=moment)

    def keep_wells(self, model: Model, label: str, hover: Operand, rest: Operand = 0.0) -> None:
        """State that the battery never runs dry nor is overcharged; in `available` only."""
        if self.perspective == AVAILABLE:
            for kind, step, moment, relation in well_limits(self, hover, rest):
                name = f"{label} {LABELS[kind]}"
                model.subject_to(name, relation, kind=kind, step=step, moment=moment)


@dataclass(frozen=True, kw_only=True)
class Formulation(ABC):
    """A problem over the quantities of an itinerary; subclass it and write `declare`.

    The problem is declared once for the direct route and, if it declares a rest, once for the
    routes via a building. Fields of its own make a subclass a dataclass.

    Parameters
    ----------
    building
        Name of the building to go via; None for all routes.
    order
        ``"rest-first"``, ``"hover-first"``, or None for the better of the two; with several devices
        before or after all hovers, or ``"between"``, or None for the best.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import optuav
    >>> @dataclass(frozen=True)
    ... class LeastRest(optuav.Formulation):
    ...     '''Least rest for a wanted hover time.'''
    ...     wanted_hover_s: float
    ...     def declare(self, model, given):
    ...         hover, rest = given.hover_and_rest(model)
    ...         model.minimise(rest)
    ...         model.subject_to("wanted hover", hover >= self.wanted_hover_s, unit="s")
    ...         given.keep_charge(model, "charge", hover, rest)
    ...         given.keep_wells(model, "charge", hover, rest)
    ...         given.keep_deadline(model, "deadline", hover, rest)
    >>> plan = optuav.solve("paper", LeastRest(700), perspective="battery")
    >>> f"{plan.rest_time_s:.1f} s at {plan.route[1]}"
    '220.4 s at b1'
    """

    building: str | None = None
    order: Order | None = None
    trajectory: Trajectory | None = field(default=None, init=False, repr=False)  # All routes
    # Names of several devices in flight order; None for the best one
    device_order: tuple[str, ...] | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        """A list of devices is as good as a tuple."""
        if isinstance(order := self.device_order, list):
            object.__setattr__(self, "device_order", tuple(order))

    def __repr__(self) -> str:
        """The class with its fields, without those that are rare where they are not stated."""
        shown = (field.name for field in fields(self) if field.repr)
        settings = ((name, getattr(self, name)) for name in shown)
        options = [f"{k}={v!r}" for k, v in settings if k not in RARE or v is not None]
        return f"{type(self).__qualname__}({', '.join(options)})"

    @property
    def name(self) -> str:
        """Name of the problem for a reader."""
        return type(self).__name__

    @abstractmethod
    def declare(self, model: Model, given: Given) -> None:
        """Declare unknowns, objective and constraints on the model."""

    def model(self, quantities: Quantities, perspective: Perspective) -> Model:
        """The declared model, with the quantities of some itineraries for its parameters.

        See `declared` for its title, its preferences and the errors.
        """
        model, values = self.declared(quantities, perspective)
        return model.with_values(values) if values else model

    def declared(self, quantities: Quantities, perspective: Perspective) -> tuple[Model, Values]:
        """Return the declared model, and values of its parameters if it holds none itself.

        A problem of the package is declared once for all itineraries of a kind, over NaN. The title
        is the first line of the class's docstring. If nothing else decides the length of a stay, it
        is as short as possible, so that answers of routes can be compared.

        Raises
        ------
        InputError
            If no unknown or no objective is declared, the perspective is `available` and
            `given.keep_wells` is not called, or a user's problem keeps the reserve only at the end
            although the mission sets ``limits.keep_soc = "always"``.
        """
        if type(self).__module__.partition(".")[0] != __package__:
            # A problem of a user may look at numbers, so that it is declared each time.
            model = _declared(self, Given.of(quantities, perspective))
            _must_keep_landings(self, model, len(quantities.landings))
            return model, {}
        values = {quantity.name: getattr(quantities, quantity.name) for quantity in QUANTITIES}
        names = tuple(name for name, value in values.items() if value is not None)
        steps = tuple(step if isinstance(step, str) else FLOWN for step in quantities.steps)
        for n, step in enumerate(quantities.steps, start=1):
            if not isinstance(step, str):
                values |= {f"step_{n}_{name}": value for name, value in step._asdict().items()}
        for n, landing in enumerate(quantities.landings, start=1):
            values |= {f"landing_{n}_As": landing.charge_As, f"landing_{n}_J": landing.energy_J}
        landings = tuple(
            landing._replace(charge_As=NAN, energy_J=NAN) for landing in quantities.landings
        )
        for n, hover in enumerate(quantities.hovers, start=1):
            figures = hover.current_A, hover.received_W
            values |= {name.format(n): x for name, x in zip(OF_HOVER, figures, strict=True)}
        for n, point in enumerate(quantities.covered, start=1):
            values |= {name.format(n): x for name, x in zip(OF_POINT, point[1:], strict=True)}
        hovers = tuple(hover._replace(current_A=NAN, received_W=NAN) for hover in quantities.hovers)
        covered = tuple(Covered(point.device, NAN, NAN) for point in quantities.covered)
        devices = hovers, covered
        kind = perspective, quantities.tapers, quantities.rests, names, steps, landings, devices
        pattern = _pattern(self, *kind)
        if quantities.tapers:
            # Which of its terms cancel is known of numbers alone.
            return pattern.with_values(values), {}
        return pattern, values


def named_landings(landings: Sequence[Landing], suffix: str = "") -> tuple[Landing, ...]:
    """Symbols for what is drawn up to each landing, such as ``landing_1_As``."""
    return tuple(
        landing._replace(
            charge_As=Parameter(f"landing_{n}_As{suffix}", f"Q_{n}{suffix}", "A s", charge_As),
            energy_J=Parameter(f"landing_{n}_J{suffix}", f"E_{n}{suffix}", "J", energy_J),
        )
        for n, landing in enumerate(landings, start=1)
        for charge_As, energy_J in [landing[:2]]
    )


OF_HOVER = ("hover_current_A[{}]", "hover_received_W[{}]")
OF_POINT = ("hover_distance_m[{}]", "hover_altitude_m[{}]")
"""Names of the figures of a hover over one of several devices, and of its hover point."""


def named_hovers(hovers: Sequence[Hover], suffix: str = "") -> Iterator[Hover]:
    """Symbols for the hovers over several devices; a share stays the number that it is."""
    for n, (share, current_A, received_W) in enumerate(hovers, start=1):
        current, received = (name.format(n) + suffix for name in OF_HOVER)
        symbols = (Indexed(sign, n) for sign in ("s", "I_hv", "P_0,hv"))
        of_share, of_current, of_received = (
            f"{symbol}{suffix}" if suffix else symbol for symbol in symbols
        )
        yield Hover(
            Share(f"share[{n}]{suffix}", of_share, "1", share, varies=False),
            Parameter(current, of_current, "A", current_A),
            Parameter(received, of_received, "W", received_W),
        )


def named_covered(covered: Sequence[Covered]) -> Iterator[Covered]:
    """Symbols for the hover points of several devices."""
    for n, (device, distance_m, altitude_m) in enumerate(covered, start=1):
        distance, altitude = (name.format(n) for name in OF_POINT)
        yield Covered(
            device,
            Parameter(distance, Indexed("d", n), "m", distance_m),
            Parameter(altitude, Indexed("z", n), "m", altitude_m),
        )


RARE = ("device_order", "hover_time_s")  # Options that show where they are stated
NAN = math.nan  # One object, as NaN is equal to itself by identity alone
RESERVE = "limits.min_soc"  # Key of the charge that must be left
FLOWN = Stage(NAN, NAN)  # A stage of flight in a pattern


@lru_cache(maxsize=64)
def _pattern(
    formulation: Formulation,
    perspective: Perspective,
    tapers: bool,
    rests: bool,
    stated: tuple[str, ...],
    steps: tuple[Stage | str, ...],
    landings: tuple[Landing, ...],
    devices: tuple[tuple[Hover, ...], tuple[Covered, ...]],
) -> Model:
    """A formulation of the package over NaN, of which all its models of a kind are copies."""
    numbers: Any = {q.name: NAN if q.name in stated else None for q in QUANTITIES}
    hovers, covered = devices
    kind: Any = {"steps": steps, "landings": landings, "tapers": tapers, "rests": rests}
    kind |= {"hovers": hovers, "covered": covered}
    quantities = Quantities(**numbers, **kind)
    return _declared(formulation, Given.of(quantities, perspective))


def _declared(formulation: Formulation, given: Given) -> Model:
    """The model that a formulation declares."""
    title = (type(formulation).__doc__ or formulation.name).strip().splitlines()[0]
    if len(given.covered) > 1:
        title = re.sub(r"\bthe device\b", "the devices", title)
    model, name = Model(title.rstrip(".")), formulation.name
    formulation.declare(model, given)
    if not model.variables:
        raise InputError(f"{name}: no unknown was declared; model.variable does")
    if not model.has_objective:
        raise InputError(f"{name}: no objective was stated; model.maximise or model.minimise does")
    dry = any(constraint.kind == "dry" for constraint in model.constraints)
    if given.perspective == AVAILABLE and not dry:
        call = "call given.keep_wells(model, label, hover, rest) in declare"
        words = f"{name} does not say when the battery must not run dry: {call}"
        raise InputError(f"{words}, or take another perspective")
    decided = {name for goal in (model.objective, *model.preferences) for name in _decided(goal)}
    names = {f"{stay}_time_s" for stay in STAYS} - decided
    if open_ := [variable for variable in model.variables if variable.name in names]:
        model.prefer_small(reduce(operator.add, open_))
    return model


def _must_keep_landings(formulation: Formulation, model: Model, count: int) -> None:
    """Refuse a model that keeps the reserve at the end, and not at as many landings as well."""
    leaves_of = (leaves(*constraint.relation.sides) for constraint in model.constraints)
    kept = sum(any(getattr(leaf, "key", "") == RESERVE for leaf in of_one) for of_one in leaves_of)
    if 0 < kept <= count:
        call = "call given.keep_charge(model, label, hover, rest) in declare"
        words = f"{formulation.name} keeps the reserve at the end only, not at landings: {call}"
        raise InputError(f"{words}, or set limits.keep_soc = 'end'")


def _decided(goal: Operand) -> Iterable[str]:
    """The unknown that a goal decides, in whatever unit it is stated; none of several."""
    with suppress(NotAffineError):
        moving = affine(goal, {}).coefficients
        return moving if len(moving) == 1 else ()
    return ()
