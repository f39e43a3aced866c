"""The routes over several devices that a question may take, in every order or in one."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np

from formulations.formulation import Formulation
from optuav.arrays import Integers
from optuav.mission import Mission
from optuav.network.network import Network
from optuav.network.routes import build_routes


def orders_of(mission: Mission, problem: Formulation) -> Integers:
    """Orders of the devices that a problem may take (order, device), the mission's first."""
    names = [device.name for device in mission.devices]
    if (wanted := getattr(problem, "device_order", None)) is not None:
        return np.array([[names.index(name) for name in wanted]])
    return np.array([*permutations(range(len(names)))])


def with_routes(network: Network, problem: Formulation) -> Network:
    """The network of several devices with the routes that a problem may take."""
    orders = orders_of(network.mission, problem)
    return replace(network, routes=build_routes(network.legs, network.buildings, orders))
