"""The network of a mission that can be flown, with its packs as one battery."""

from __future__ import annotations

from collections.abc import Iterator

from optuav.errors import Fault, NoPlanError
from optuav.mission import Mission
from optuav.mission.messages import shown
from optuav.network.feasibility import impossibilities
from optuav.network.network import Network, build_network


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
