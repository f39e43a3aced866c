"""Checks that the questions about a service share: packs, network and what charges."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from optuav.errors import Fault, InputError, NoPlanError
from optuav.mission import Mission
from optuav.mission.messages import shown
from optuav.network.feasibility import impossibilities
from optuav.network.network import Network, build_network

if TYPE_CHECKING:
    from optuav.service.cycle import Coverage


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
