"""Numbers of the abstract and of sections I to III about the source, the bands and other papers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from optuav.arrays import Floats
from optuav.network import vehicle
from optuav.network.places import HOVER
from optuav.paper.curves.charging import source_power_for_full_charge_W
from optuav.paper.ledger.scenario import Scenario, papers
from optuav.paper.ledger.statement import Statement, Value
from optuav.physics import laser

LIGHT_M_S = 299_792_458.0
KILOWATT_W = 1000.0
OTHER_PAPERS = (
    ("layers-kaleem", "section I", "layers of the architecture of Kaleem et al.", "3"),
    ("layers-chakareski", "section I-A", "layers of the problem of Chakareski et al.", "2"),
    ("gain-chakareski", "section I-A", "gain in energy efficiency there, nearly", "2"),
    ("model-doyle", "section III-A", "differential equations of Doyle's model", "6"),
)
"""Name, place, what and number of statements about other papers."""


def statements() -> Iterator[Statement]:
    """Every number of these places."""
    yield Statement(
        name="source-below-1-kw",
        place="abstract; section I-B (twice)",
        what="power of the laser source",
        stated="below 1 kW",
        how="what makes the battery take I_ch at the hover point and on every roof",
        compute=_source_power,
        reason=lambda: f"{_for_full_charge_W(papers()[0]):.0f} W are enough everywhere",
    )
    yield Statement(
        name="source-kilowatts",
        place="section I-B",
        what="transmitter that charges a flying UAV efficiently",
        stated="kilowatts",
        how="source whose received power at the hover point is all that hovering takes",
        compute=lambda s: f"{_for_hover_W(s) / KILOWATT_W:.1f} kW",
        undecided="no share of the hover power is stated",
    )
    yield Statement(
        name="band-laser",
        place="section II",
        what="frequency of the laser",
        stated="above 1 THz",
        how="speed of light over λ of Table I",
        compute=lambda s: "above 1 THz" if _laser_THz(s) > 1.0 else f"{_laser_THz(s):.3g} THz",
        reason=lambda: f"{_laser_THz(papers()[0]):.1f} THz",
    )
    yield Statement(
        name="band-radio",
        place="section II",
        what="frequency of the link",
        stated="below 6 GHz",
        how="not computed: outage depends on distance, noise and power only",
        compute=lambda _: None,
        undecided="no carrier enters the link",
    )
    for name, place, what, stated in OTHER_PAPERS:
        yield Statement(
            name=name,
            place=place,
            what=what,
            stated=stated,
            how="not computed: another paper's",
            compute=lambda _: None,
            undecided="a statement about another paper",
        )


def _source_power(scenario: Scenario) -> Value:
    needed_W = _for_full_charge_W(scenario)
    return "below 1 kW" if needed_W < KILOWATT_W else f"{needed_W:.0f} W"


def _distances_m(scenario: Scenario) -> Floats:
    """From the laser to the hover point, and to every roof [m]."""
    assert scenario.mission.laser is not None
    where = scenario.worked_out.places
    places_m = where.position_m[[HOVER, *where.buildings]]
    laser_m = np.array(scenario.mission.laser.position_m)
    return np.asarray(np.linalg.norm(places_m - laser_m, axis=1), dtype=float)


def _for_full_charge_W(scenario: Scenario) -> float:
    """Source power that charges fully wherever the plan may charge [W]."""
    return float(np.max(source_power_for_full_charge_W(scenario.mission, _distances_m(scenario))))


def _for_hover_W(scenario: Scenario) -> float:
    """Source power that the receiver turns into all of the hover power [W]."""
    share = laser.transmission(
        vehicle.attenuation_per_km(scenario.mission), _distances_m(scenario)[0]
    )
    hover_W = float(vehicle.hover_load(scenario.mission).power_W)
    return float(laser.source_limit(vehicle.conversion(scenario.mission), hover_W, share))


def _laser_THz(scenario: Scenario) -> float:
    assert scenario.mission.laser is not None
    return LIGHT_M_S / (scenario.mission.laser.wavelength_nm * 1e-9) / 1e12
