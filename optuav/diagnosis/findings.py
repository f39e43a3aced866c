"""An answer explained, as data: what binds or conflicts, proofs, prices and repairs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

from optuav.diagnosis.infeasibility import Certificate, Conflict, plain
from optuav.diagnosis.key_prices import KeyPrice
from optuav.diagnosis.parameter_prices import Price
from optuav.diagnosis.repair import Repair
from optuav.frames import DataFrame, frame
from optuav.plan import Plan
from optuav.presentation.numbers import figure, percent, with_unit


@dataclass(frozen=True)
class ConstraintAtOptimum:
    """A constraint at the optimum."""

    label: str
    unit: str
    statement: str  # The constraint as mathematics; empty for one too long to read
    left: float
    sense: str
    right: float
    slack: float
    binds: bool  # Whether it holds with equality
    kind: str = ""  # Kind and step of the limit, as in a `Constraint`
    step: int | None = None
    in_flight: bool = False  # Whether that step is a stage of flight
    words: str = ""  # Limited quantity, without symbols
    is_share: bool = False  # Whether both sides are shares of the capacity

    @property
    def both_sides(self) -> str:
        """Both sides in numbers, shares in percent."""
        if self.is_share:
            return f"{percent(self.left)} {self.sense} {percent(self.right)}"
        left = figure(self.left, beside=max(1.0, abs(self.right)))
        return f"{left} {self.sense} {with_unit(self.right, self.unit)}"

    @property
    def spare(self) -> str:
        """The slack, or that it binds."""
        if self.binds:
            return "binds"
        return percent(self.slack) if self.is_share else with_unit(self.slack, self.unit)


@dataclass(frozen=True)
class Findings:
    """The data of an `Explanation`. True where there is a plan."""

    plan: Plan
    objective: str = ""
    sense: str = "maximise"
    conflicts: tuple[Conflict, ...] = ()
    repairs: tuple[Repair, ...] = ()
    constraints: tuple[ConstraintAtOptimum, ...] = ()
    bound: Certificate | None = None
    prices: tuple[Price, ...] = ()
    key_prices: tuple[KeyPrice, ...] = ()
    notes: tuple[str, ...] = ()
    more_stops_open: bool = False
    gain_s: float | None = None
    doubt_costs_s: Mapping[str, float] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.plan)

    def to_frame(self) -> DataFrame:
        """The prices, one row a parameter; without a plan the repairs; needs pandas.

        Columns are the attributes of `optuav.diagnosis.parameter_prices.Price`, or as
        `optuav.diagnosis.Repair.to_dict` has them.
        """
        return frame(map(asdict, self.prices) if self else (r.to_dict() for r in self.repairs))

    def to_dict(self) -> dict[str, object]:
        """Return plain data: strings, numbers, lists, dicts and None."""
        plan = self.plan
        names = ["problem", "trajectory", "building", "order", "perspective", "slot_s", "proof"]
        names += ["hover_time_s", "rest_time_s", "route"] if plan else ["reasons"]
        of_explanation = ["objective", "constraints", "bound", "prices", "key_prices"]
        of_explanation = of_explanation if plan else ["conflicts", "repairs"]
        of_explanation += ["more_stops_open", "gain_s", "doubt_costs_s", "notes"]
        fields = {name: getattr(plan, name) for name in names}
        fields |= {name: getattr(self, name) for name in of_explanation}
        return {"mission": plan.mission.name, "status": plan.status.value, **plain(fields)}
