"""A mission of the paper with the questions that the ledger asks of it, each answered once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from optuav.mission import Mission, load
from optuav.network.legs import Legs
from optuav.network.network import Network, build_network
from optuav.plan import Plan
from optuav.solving import solve


@dataclass(frozen=True)
class Scenario:
    """A mission, and the plans that were asked for.

    Parameters
    ----------
    mission
        ``paper`` or ``paper-table2``.
    """

    mission: Mission
    answers: dict[Any, Any] = field(default_factory=dict, compare=False, repr=False)

    def once(self, key: Any, compute: Callable[[], Any]) -> Any:
        """What is computed, at the first time only."""
        if key not in self.answers:
            self.answers[key] = compute()
        return self.answers[key]

    @property
    def has_rotors(self) -> bool:
        """Whether its loads follow from motors."""
        return self.mission.flight.model == "rotors"

    @property
    def worked_out(self) -> Network:
        """Places, legs and itineraries."""
        found: Network = self.once("network", lambda: build_network(self.mission))
        return found

    @property
    def legs(self) -> Legs:
        """All legs; the first is from the origin to the hover point."""
        return self.worked_out.legs

    def plan(self, changes: Mapping[str, Any] | None = None, **asked: Any) -> Plan:
        """The plan for a question, with some keys of the mission changed.

        By charge at the end, as the paper counts, unless another perspective is asked for.
        """
        asked = {"perspective": "battery", **asked}
        key = (tuple(sorted((changes or {}).items())), tuple(sorted(asked.items())))
        found: Plan = self.once(
            key, lambda: solve(self.mission.replace(dict(changes or {})), **asked)
        )
        return found


@cache
def papers() -> tuple[Scenario, Scenario]:
    """By the printed parameters, and by the recovered loads."""
    return Scenario(load("paper")), Scenario(load("paper-table2"))
