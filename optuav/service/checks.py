"""Checks that the questions about a service share: packs, network and what charges."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from optuav.errors import Fault, InputError, NoPlanError
from optuav.mission import Mission
from optuav.mission.messages import shown
from optuav.network import vehicle
from optuav.network.feasibility import impossibilities
from optuav.network.network import Network, build_network

if TYPE_CHECKING:
    from optuav.service.cycle import Coverage

Answer = TypeVar("Answer")


def in_calm_air(mission: Mission, ask: Callable[[Mission], Answer]) -> Answer | str | None:
    """The answer in calm air, or why there is none, if hovering counts on the wind; else None."""
    calm = vehicle.in_calm_air(mission)
    try:
        return None if calm is None else ask(calm)
    except (InputError, NoPlanError) as error:
        return str(error)


def calm_facts(name: str, answer: float | str | None, words: str) -> dict[str, float | str | None]:
    """A figure in calm air as a fact of a name, and in words, which may say why there is none."""
    if answer is None or isinstance(answer, str):
        return {name: None, "in_calm_air": answer}
    return {name: answer, "in_calm_air": words.format(answer)}


def calm_line(facts: Mapping[str, Any]) -> Iterator[str]:
    """Yield what calm air gives, where an answer counts on the wind."""
    if facts["in_calm_air"] is not None:
        yield f"Wind        this holds while the wind blows; in calm air: {facts['in_calm_air']}"


def schedule_faults(mission: Mission) -> Iterator[Fault]:
    """Yield a fault if packs take turns."""
    if mission.battery.takes_turns:
        words = "must be 'pooled': all packs count as one battery here"
        yield Fault("battery.schedule", shown(mission.battery.schedule), words)


def flyable_network(mission: Mission) -> Network:
    """Return the network of a mission, or refuse a mission that no plan can fly."""
    network = build_network(mission)
    if reasons := impossibilities(network, one_stop=False):
        raise NoPlanError("; ".join(reasons))
    return network


def need_laser(coverage: Coverage) -> None:
    """Refuse an endless hover, a dark hover, and charging by anything but the laser."""
    coverage.ending()
    if coverage.charged_by != "laser" or not coverage.lit_hover:
        name = {"pad": "pad_power_W", "exchange": "swap_s"}.get(coverage.charged_by, "lit_hover")
        words = "must be left out: the mission's laser serves hover and rest here"
        raise InputError([Fault(name, "", words)])
