"""Missions of laser-charged drones: modelled, solved with proof, and checked.

The public names load on first use, so that importing the package is quick.
"""

from __future__ import annotations

import os
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from formulations.formulation import Formulation as Formulation
    from formulations.p1 import P1 as P1
    from formulations.p2 import P2 as P2
    from formulations.p3 import P3 as P3
    from formulations.p4 import P4 as P4
    from optuav.calibration import Fit as Fit
    from optuav.calibration import fit_kibam as fit_kibam
    from optuav.calibration import fit_regimes as fit_regimes
    from optuav.calibration import fit_rotor as fit_rotor
    from optuav.calibration import fit_table as fit_table
    from optuav.diagnosis import explain as explain
    from optuav.engines.bracket import Bracket as Bracket
    from optuav.engines.casadi_engine import Casadi as Casadi
    from optuav.engines.closed_form import ClosedForm as ClosedForm
    from optuav.engines.cvxpy_engine import Cvxpy as Cvxpy
    from optuav.engines.grid import Grid as Grid
    from optuav.errors import Fault as Fault
    from optuav.errors import InputError as InputError
    from optuav.errors import NoPlanError as NoPlanError
    from optuav.errors import OptuavError as OptuavError
    from optuav.errors import SolverError as SolverError
    from optuav.judge import Itinerary as Itinerary
    from optuav.judge import audit as audit
    from optuav.judge import replay as replay
    from optuav.mission import Mission as Mission
    from optuav.mission import json_schema as json_schema
    from optuav.mission import load as load
    from optuav.mission import shipped as shipped
    from optuav.mission.template import Datasheet as Datasheet
    from optuav.network.graph import graph as graph
    from optuav.network.graph import validate_graph as validate_graph
    from optuav.paper.ledger import ledger as ledger
    from optuav.paper.report import reproduce as reproduce
    from optuav.plan import Plan as Plan
    from optuav.plan import load_plan as load_plan
    from optuav.solving import Program as Program
    from optuav.solving import formulate as formulate
    from optuav.solving import solve as solve
    from optuav.solving.batch import longest_hovers as longest_hovers
    from optuav.solving.route_choice import route_choice as route_choice
    from optuav.studies.compare import compare as compare
    from optuav.studies.sensitivity import sensitivity as sensitivity

    __version__: str

HOMES = {
    name: module
    for module, names in {
        "formulations.formulation": "Formulation",
        "formulations.p1": "P1",
        "formulations.p2": "P2",
        "formulations.p3": "P3",
        "formulations.p4": "P4",
        "optuav.calibration": "Fit fit_kibam fit_regimes fit_rotor fit_table",
        "optuav.diagnosis": "explain",
        "optuav.engines.bracket": "Bracket",
        "optuav.engines.casadi_engine": "Casadi",
        "optuav.engines.closed_form": "ClosedForm",
        "optuav.engines.cvxpy_engine": "Cvxpy",
        "optuav.engines.grid": "Grid",
        "optuav.errors": "Fault InputError NoPlanError OptuavError SolverError",
        "optuav.judge": "Itinerary audit replay",
        "optuav.mission": "Mission json_schema load shipped",
        "optuav.mission.template": "Datasheet",
        "optuav.network.graph": "graph validate_graph",
        "optuav.paper.ledger": "ledger",
        "optuav.paper.report": "reproduce",
        "optuav.plan": "Plan load_plan",
        "optuav.solving": "Program formulate solve",
        "optuav.solving.batch": "longest_hovers",
        "optuav.solving.route_choice": "route_choice",
        "optuav.studies.compare": "compare",
        "optuav.studies.sensitivity": "sensitivity",
    }.items()
    for name in names.split()
}
"""Where each public name is defined."""

_FOUND = find_spec("formulations")
_FOLDERS = (_FOUND and _FOUND.submodule_search_locations) or ()
if not any(os.path.exists(os.path.join(each, "formulation.py")) for each in _FOLDERS):
    raise ImportError(
        f"{_FOUND.origin if _FOUND else 'nothing'} is found as 'formulations', and hides the "
        "package of this name that comes with optuav: rename it, or work in another folder"
    )

__all__ = ["__version__", "plots", *sorted(HOMES)]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("optuav")
    if name == "plots":
        return import_module("optuav.plots")
    if name not in HOMES:
        raise AttributeError(f"module 'optuav' has no attribute {name!r}")
    value = getattr(import_module(HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
