"""The buildings that a plan uses, which its file holds in place of a whole table."""

from __future__ import annotations

import os
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from optuav.errors import Fault, InputError, refuse, safe_name
from optuav.mission.buildings import Buildings, TableFile
from optuav.mission.files import label
from optuav.mission.messages import shown
from optuav.mission.table_files import check, read_buildings
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, crossed
from optuav.network.places import ends_of
from optuav.network.prisms import prisms
from optuav.plan.data import PlanData
from optuav.plan.summary import TABLE


def used_buildings(plan: PlanData) -> Buildings:
    """Buildings on its route or in its question, and those that block its legs or the laser."""
    mission, buildings, route = plan.mission, plan.mission.buildings, plan.mission.route
    names = {end for phase in plan.phases for end in (phase.start_place, phase.end_place)}
    numbers = {k: name for k, name in enumerate(buildings.names) if name in {*names, plan.building}}
    first_m, *others_m = vehicle.hover_points_m(mission)
    ends_m = route.origin_m, first_m, route.destination_m, *others_m
    at_m = {name: (CLEAR, end) for name, end in zip(ends_of(mission), ends_m, strict=True)}
    at_m |= {name: (k, tuple(buildings.roof_m[k])) for k, name in numbers.items()}
    lines: list[Any] = []
    for leg in (phase for phase in plan.phases if phase.kind == "flight"):
        by = ((CLEAR, at) for at in leg.waypoints_m)
        lines += pairwise([at_m[leg.start_place], *by, at_m[leg.end_place]])
    if mission.laser is not None:
        lines += [((CLEAR, mission.laser.position_m), at_m[name]) for name in names]
    finite = [(a, b) for a, b in lines if np.isfinite([a[1], b[1]]).all()]
    if finite:
        start_m, end_m = (np.array([line[k][1] for line in finite], dtype=float) for k in (0, 1))
        own_buildings = np.array([(a[0], b[0]) for a, b in finite])
        blockers = crossed(prisms(buildings), start_m, end_m, own_buildings)
        numbers |= dict.fromkeys(blockers[blockers != CLEAR].tolist(), "")
    return Buildings.of(buildings[k] for k in sorted(numbers))


def with_table(embedded: Buildings, stated: object, folder: Path) -> Buildings:
    """All buildings of the table that a plan names where that is there, or else those embedded.

    Raises `InputError` if it is another table, or if the plan's buildings are not in it.
    """
    kinds = {"path": str, "sha256": str, "buildings": int}
    known: dict[str, Any] = stated if isinstance(stated, dict) else {}
    if {key: type(value) for key, value in known.items()} != kinds or "\0" in known["path"]:
        raise InputError(
            [Fault(TABLE, shown(stated), "must have path, sha256 and buildings of a table")]
        )
    path, sha256, count = (known[key] for key in kinds)
    source = TableFile(os.path.abspath(folder / path), sha256, max(count, len(embedded)))
    if not os.path.exists(source.path):
        return embedded.read_from(source)
    check(Path(source.path), sha256)
    table = read_buildings(Path(source.path))
    numbers = {name: number for number, name in enumerate(table.names)}
    refuse(
        Fault(f"buildings.{safe_name(building.name)}", "", f"is not as in {label(Path(path))}")
        for building in embedded
        if building.name not in numbers or table[numbers[building.name]] != building
    )
    return table
