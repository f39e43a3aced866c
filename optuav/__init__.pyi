"""The public names for type checkers; at run time, the list of where each is defined."""

from formulations.formulation import Formulation as Formulation
from formulations.p1 import P1 as P1
from formulations.p2 import P2 as P2
from formulations.p3 import P3 as P3
from formulations.p4 import P4 as P4
from optuav import plots as plots
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
