"""Engines stand alone, and load when they are first needed."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import optuav.engines
from optuav.engines.registry import CLASSES, ENGINES

DIRECTORY = Path(optuav.engines.__file__).parent
MODULES = {name: place.partition(".")[0] for name, place in CLASSES.items()}
"""Where each engine lives."""
HEAVY = (
    "casadi",
    "cvxpy",
    "highspy",
    "matplotlib",
    "pandas",
    "pyomo",
    "scipy.stats",
    "scipy.optimize",
)
HEAVY += ("optuav.mission.benchmark",)


def imported(module: Path) -> Iterator[str]:
    """Names of all modules that a module imports, in functions too."""
    for node in ast.walk(ast.parse(module.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
            yield str(node.module)


def test_every_engine_of_the_table_has_its_module() -> None:
    assert MODULES.keys() == set(ENGINES)
    assert all((DIRECTORY / f"{module}.py").is_file() for module in MODULES.values())


@pytest.mark.parametrize("module", sorted(DIRECTORY.glob("*.py")), ids=lambda path: path.stem)
def test_modules_of_engines_import_no_engine_and_no_formulation(module: Path) -> None:
    """Not each other, and what they share imports none of them; nor physics, missions or plans."""
    engines = {f"optuav.engines.{name}" for name in MODULES.values()}
    found = set(imported(module))
    assert not found & (engines - {f"optuav.engines.{module.stem}"})
    ours = {name.split(".")[1] for name in found if name.startswith("optuav.")}
    assert ours <= {
        *("engines", "modelling", "arrays", "errors", "frames", "presentation", "silence", "status")
    }
    assert not any(name.partition(".")[0] == "formulations" for name in found)


@pytest.mark.parametrize("module", sorted(DIRECTORY.glob("*.py")), ids=lambda path: path.stem)
def test_solvers_are_imported_inside_functions(module: Path) -> None:
    """Only one engine knows a library, and only from its first call on."""
    body = ast.parse(module.read_text("utf-8")).body
    top = {alias.name for node in body if isinstance(node, ast.Import) for alias in node.names}
    top |= {str(node.module) for node in body if isinstance(node, ast.ImportFrom)}
    assert not any(name.startswith(HEAVY) for name in top)
    libraries = {name.partition(".")[0] for name in imported(module)} & {"casadi", "cvxpy", "pyomo"}
    owned = {each: {each.removesuffix("_engine")} for each in MODULES.values()}
    owned["pyomo_model"] = {"pyomo"}
    assert libraries <= owned.get(module.stem, set())


LOADED = f"""
import sys
print("loaded:", *[name for name in {HEAVY!r} if name in sys.modules])
"""


def loaded(*programs: str) -> list[set[str]]:
    """Which heavy modules are loaded at the end of each of some programs, run in one process."""
    script = "".join(f"{program}{LOADED}" for program in programs)
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    told = [line for line in done.stdout.splitlines() if line.startswith("loaded:")]
    return [set(line.split()[1:]) for line in told]


COMMAND = """
from optuav.cli import main
try:
    main({arguments!r})
except SystemExit as exit:
    assert not exit.code
"""
LIGHT = {
    "formulations": "import formulations.p4",
    "import": "import optuav, optuav.engines.prices",
    "compile": "optuav.formulate('paper').compile().solve().shadow_prices()",
    "command line": "import optuav.cli",
    "formulate": COMMAND.format(arguments=["formulate", "paper"]),
    "solve": COMMAND.format(arguments=["solve", "paper"]),
    "slots": COMMAND.format(arguments=["solve", "paper", "--slot-s", "60"]),
    "return": COMMAND.format(arguments=["return", "paper"]),
}


@pytest.mark.parametrize(
    "engines", [("cvxpy", "casadi"), pytest.param(("casadi", "cvxpy"), marks=pytest.mark.soak)]
)
def test_nothing_heavy_is_loaded_before_an_engine_needs_it(engines: tuple[str, str]) -> None:
    """No solvers, plots, slow parts of scipy, nor the benchmark set, one thing done after another.

    Formulations come first, as they can be imported before optuav. Then each engine loads its own
    library, and both live in one process, in any order: they have been seen to fail after another.
    """
    asked = "optuav.solve('paper', 'P3', engine={!r}, perspective='battery').hover_time_s"
    programs = (f"import optuav; assert round({asked}, 3) == 688.848".format(e) for e in engines)
    *light, first, both = loaded(*LIGHT.values(), *programs)
    assert dict(zip(LIGHT, light, strict=True)) == {name: set() for name in LIGHT}
    assert first & {"cvxpy", "casadi", "matplotlib"} == {engines[0]}
    assert both >= {*engines}


def test_an_event_loads_one_solver() -> None:
    """HiGHS for its linear programme, not all of scipy.optimize, which took as long as the rest."""
    event = COMMAND.format(arguments=["coverage", "matrice350", "--hours", "2"])
    assert loaded(event) == [{"highspy"}]
