"""Checks that the questions about a service share: packs, network and what charges."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

from optuav.errors import Fault, InputError, NoPlanError
from optuav.mission import Mission
from optuav.mission.messages import shown
from optuav.network import vehicle
from optuav.network.feasibility import impossibilities
from optuav.network.network import Network, build_network

Answer = TypeVar("Answer")


def in_calm_air(mission: Mission, ask: Callable[[Mission], Answer]) -> Answer | str | None:
    """The answer in calm air, or why there is none, if hovering counts on the wind; else None."""
    calm = vehicle.in_calm_air(mission)
    try:
        return None if calm is None else ask(calm)
    except (InputError, NoPlanError) as error:
        return str(error)


def with_words(
    answer: Answer | str | None, words: Callable[[Answer], str]
) -> tuple[Answer, str] | tuple[None, str | None]:
    """A figure in calm air and the same in words, which may say why there is none."""
    if answer is None or isinstance(answer, str):
        return None, answer
    return answer, words(answer)


def calm_facts(in_calm_air: str | None) -> Iterator[tuple[str, str]]:
    """Yield what calm air gives, where an answer counts on the wind."""
    if in_calm_air is not None:
        yield "Wind", f"this holds while the wind blows; in calm air: {in_calm_air}"


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
