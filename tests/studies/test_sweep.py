"""Sweeps have the answers of batches, and the same bytes whoever makes them and however often."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import random
import signal
import subprocess
import sys
import time
from importlib import metadata
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.engines.closed_form import ClosedForm
from optuav.errors import InputError
from optuav.judge.benchmark import answers
from optuav.mission import files
from optuav.studies import scenarios as machine
from optuav.studies.study import read_plan
from optuav.studies.sweep import SweepParts, _sealed
from tests.examples import few
from tests.several_devices import three

GRID = """
perspective = ["battery", "available"]
scenarios_per_part = 7
[grid]
limits.deadline_s = { low = 30, high = 1230, count = 5 }
"battery.capacity_As" = [3_000, 36_000, 30_000]
"""
DEADLINES, SIZES = np.linspace(30.0, 1230.0, 5), np.array([3e3, 36e3, 30e3])
MIXED = """
scenarios_per_part = 10
[grid]
limits.deadline_s = [600, 1200]
battery.flow_rate_per_s = [0.001, 0.002, 0.004]
[samples]
count = 9
seed = 3
battery.capacity_As = { percent = 10 }
"wind.force_N[0]" = { deviation = 1.0 }
"""
SPREAD = {"battery.capacity_As": {"percent": 10}, "wind.force_N[0]": {"deviation": 1.0}}


def study(folder: Path, text: str, name: str = "study") -> Path:
    """A study file; its parts are in the directory of its name beside it."""
    file = folder / f"{name}.toml"
    file.write_text(text)
    return file


def content(folder: Path) -> dict[str, bytes]:
    """All files of a directory, hidden ones too."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def swept(folder: Path, text: str, name: str = "study", **options: Any) -> Any:
    """The dataset of a study."""
    return optuav.open_sweep(optuav.sweep(study(folder, text, name), **options).directory)


# What is found


def test_a_grid_is_the_batch_of_its_values(tmp_path: Path) -> None:
    """Variables, coordinates, units, words and types, with parts that end within a row."""
    values = {"limits.deadline_s": DEADLINES, "battery.capacity_As": SIZES}
    expected = optuav.batch("paper", values, perspective=["battery", "available"])
    xarray.testing.assert_identical(found := swept(tmp_path, GRID), expected)
    assert len(content(tmp_path / "study")) == 1 + 3
    assert found.hover_time_s.isnull().any()
    assert {each.dtype for each in found.values()} == {each.dtype for each in expected.values()}
    assert [repr(each.attrs) for each in found.values()] == [
        repr(each.attrs) for each in expected.values()
    ]


def test_samples_are_those_of_samples(tmp_path: Path) -> None:
    """Whatever the size of the parts; a mission file is found beside the study."""
    optuav.load("paper").replace({"limits.deadline_s": 900}).save(tmp_path / "own.toml")
    mission = optuav.load(tmp_path / "own.toml")
    drawn = optuav.samples(mission, SPREAD, 21, seed=5)
    expected = optuav.batch(mission, drawn, "P3", perspective="battery", paired=True)
    text = 'mission = "own.toml"\nproblem = "P3"\nperspective = "battery"\nscenarios_per_part = 4\n'
    text += "[samples]\ncount = 21\nseed = 5\nbattery.capacity_As = { percent = 10 }\n"
    text += '"wind.force_N[0]" = { deviation = 1.0 }\n'
    xarray.testing.assert_identical(swept(tmp_path, text), expected)


def test_rows_go_with_every_combination_of_the_grid(tmp_path: Path) -> None:
    """Each sample with each value of the other keys, as batches of single rows have them."""
    found = swept(tmp_path, MIXED)
    drawn = optuav.samples("paper", SPREAD, 9, seed=3)
    assert [*found.sizes] == ["scenario", "limits.deadline_s", "battery.flow_rate_per_s"]
    values = {"limits.deadline_s": [600, 1200], "battery.flow_rate_per_s": [0.001, 0.002, 0.004]}
    for row in (0, 4, 8):
        at = {key: column[row] for key, column in drawn.items()}
        alone = optuav.batch_arrays("paper", {**{k: [v] for k, v in at.items()}, **values})
        same = alone["hover_time_s"][0, 0]
        np.testing.assert_array_equal(found.hover_time_s[row], same)
        for key, value in at.items():
            assert found[key][row] == value


def test_rows_that_are_stated_and_a_problem_with_fields(tmp_path: Path) -> None:
    text = 'problem = { name = "P4", building = "b3", order = "rest-first" }\n'
    text += "[paired]\nlimits.deadline_s = [800, 1200]\nbody.mass_kg = [1.4, 1.5]\n"
    values = {"limits.deadline_s": [800, 1200], "body.mass_kg": [1.4, 1.5]}
    problem = optuav.P4("b3", order="rest-first")
    expected = optuav.batch("paper", values, problem, paired=True)
    xarray.testing.assert_identical(swept(tmp_path, text), expected)


def test_a_mission_of_the_benchmark_set_goes_by_its_name(tmp_path: Path) -> None:
    """Its best known answers are those of the sweep."""
    found = swept(tmp_path, 'mission = "set/reserve-30"\n[grid]\nlimits.deadline_s = [1200]\n')
    known = answers()["set/reserve-30", "P1", "available"].hover_s
    assert found.hover_time_s.values.ravel() == pytest.approx([known], abs=1e-5)


@pytest.mark.parametrize(
    "grid", ['[grid]\n"devices.west.position_m[0]"', '[grid.devices.west]\n"position_m[0]"']
)
def test_a_place_of_one_of_several_devices_varies(tmp_path: Path, grid: str) -> None:
    """A column has the name of its key, and each scenario is solved as if it were stated."""
    three().save(tmp_path / "three.toml")
    key, x = "devices.west.position_m[0]", [300.0, 500.0]
    text = f'mission = "three.toml"\noutput = "study"\n{grid} = {x}\n'
    file = tmp_path / "study.toml"
    file.write_text(text)
    found = optuav.open_sweep(optuav.sweep(file).directory)
    moved = (three().replace({"devices.west.position_m": [at, 2600, 0]}) for at in x)
    expected = [optuav.solve(mission).hover_time_s for mission in moved]
    assert found[key].values.tolist() == x
    assert found.hover_time_s.values.tolist() == pytest.approx(expected)


def test_the_files_speak_for_themselves(tmp_path: Path) -> None:
    """Whoever reads them with another library finds words, not their numbers, and units."""
    from pyarrow import parquet

    done = optuav.sweep(study(tmp_path, GRID))
    table = parquet.read_table(done.directory / "part-000000.parquet")
    row = table.slice(0, 1).to_pylist()[0]
    assert row["perspective"] == "battery"
    assert row["reason"] == "the shortest flight takes longer than limits.deadline_s"
    assert row["building"] is None
    assert table.schema.field("hover_time_s").metadata == {b"units": b"s"}
    assert table.schema.field("battery.capacity_As").metadata == {b"units": b"A s"}
    assert table.num_rows == 14


# Rows


@given(
    sizes=st.lists(st.integers(1, 4), min_size=1, max_size=3),
    first=st.integers(0, 40),
    count=st.integers(1, 40),
    kind=st.sampled_from(["", "paired", "samples"]),
)
@few(20)
def test_any_rows_are_those_of_the_whole(
    tmp_path_factory: pytest.TempPathFactory, sizes: list[int], first: int, count: int, kind: str
) -> None:
    """The last key fastest and the row slowest, as nested loops would go."""
    keys = ("limits.deadline_s", "battery.capacity_As", "laser.power_W")
    lines = [
        f"grid.{key} = {[1000 + n for n in range(k)]}" for key, k in zip(keys, sizes, strict=False)
    ]
    values = [[1000.0 + n for n in range(k)] for k in sizes]
    if kind == "paired":
        lines.append("paired.body.mass_kg = [1.0, 2.0, 3.0]")
        values.insert(0, [1.0, 2.0, 3.0])
    elif kind == "samples":
        lines += ["samples.count = 5", "samples.body.mass_kg = { percent = 10 }"]
        drawn = optuav.samples("paper", {"body.mass_kg": {"percent": 10}}, 5)
        values.insert(0, drawn["body.mass_kg"].tolist())
    file = study(tmp_path_factory.getbasetemp(), "\n".join(lines), "rows")
    rows = [*itertools.product(*values)]
    count = min(count, max(1, len(rows) - first))
    first = min(first, len(rows) - count)
    found = read_plan(file).scenarios.values_by_key(first, count)
    assert [*zip(*found.values(), strict=True)] == rows[first : first + count]


def test_no_row_needs_those_before_it(tmp_path: Path) -> None:
    """The last of 10⁹ rows, which would fill 24 GB, at once."""
    text = "samples.count = 10_000_000\nsamples.body.mass_kg = { percent = 10 }\n"
    text += "grid.limits.deadline_s = { low = 600, high = 1200, count = 100 }"
    whole = read_plan(study(tmp_path, text + "\nscenarios_per_part = 1_000_000")).scenarios
    assert whole.count == 10**9
    last = whole.values_by_key(10**9 - 2, 2)
    assert last["limits.deadline_s"][1] == 1200.0
    assert last["body.mass_kg"][0] == last["body.mass_kg"][1]


# The same bytes


def test_bytes_do_not_depend_on_the_chunk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """How many itineraries a machine computes at once is no part of the answer."""
    alike = []
    for chunk in (1, 100, 1 << 17):
        monkeypatch.setattr(machine, "ITINERARIES_AT_ONCE", chunk)
        alike.append(content(optuav.sweep(study(tmp_path, MIXED, f"chunk{chunk}")).directory))
    assert alike[0] == alike[1] == alike[2]


def test_what_is_there_stays_and_what_is_broken_is_made_again(tmp_path: Path) -> None:
    """Parts that are missing, cut off, empty or another's; and what a kill leaves half-written."""
    file = study(tmp_path, GRID)
    directory = optuav.sweep(file).directory
    whole = content(directory)
    first, second, third = (directory / f"part-00000{n}.parquet" for n in range(3))
    kept = third.stat().st_mtime_ns
    first.write_bytes(first.read_bytes()[:-9])
    second.write_bytes(third.read_bytes())
    (directory / files.TEMPORARY).write_bytes(b"PAR1")
    steps: list[tuple[int, int | None, str]] = []
    again = optuav.sweep(file, progress=lambda *step: steps.append(step))
    assert content(directory) == whole
    assert third.stat().st_mtime_ns == kept
    assert (again.parts, again.kept) == (3, 1)
    assert [done for done, *_ in steps] == [1, 8, 15]
    second.write_bytes(b"")
    assert optuav.sweep(file).kept == 2
    assert content(directory) == whole


def test_any_byte_that_changed_is_found_and_its_part_made_again(tmp_path: Path) -> None:
    """Wherever in the part it is; opened, the sweep names the way out."""
    file = study(tmp_path, GRID)
    part = optuav.sweep(file).directory / "part-000001.parquet"
    good = part.read_bytes()
    stamp = json.loads((part.parent / "manifest.json").read_text())["hash"]
    for place in [*range(0, len(good), 41), len(good) - 1]:
        part.write_bytes(good[:place] + bytes([good[place] ^ 1]) + good[place + 1 :])
        assert not SweepParts(part.parent, stamp, 15, 7, side=2).is_whole(1), place
    with pytest.raises(InputError, match="1 of 3 parts are missing or damaged; optuav sweep goes"):
        optuav.open_sweep(part.parent)
    assert optuav.sweep(file).kept == 2
    assert part.read_bytes() == good
    assert optuav.sweep(file, resume=False).kept == 0
    assert part.read_bytes() == good


def test_a_manifest_without_parts_gives_way_to_the_next_study(tmp_path: Path) -> None:
    """As a sweep leaves it that is ended before its first part."""
    file = study(tmp_path, GRID)
    directory = optuav.sweep(file).directory
    for each in directory.glob("part-*"):
        each.unlink()
    file.write_text(MIXED)
    assert optuav.sweep(file).kept == 0
    assert optuav.open_sweep(directory).sizes["scenario"] == 9


def kills(tmp_path: Path, count: int, parts: int, seed: int) -> None:
    """Kill the command at random moments until it was killed so often, then compare its files."""
    draw = random.Random(seed)
    text = f"scenarios_per_part = 300\n[samples]\ncount = {300 * parts}\n"
    text += "battery.capacity_As = { percent = 10 }\n"
    expected = content(optuav.sweep(study(tmp_path, text, "whole")).directory)
    file, directory = study(tmp_path, text, "killed"), tmp_path / "killed"
    there = 0
    for _ in range(count):
        wanted = there + draw.randrange(parts // (2 * count) + 1)
        done = subprocess.Popen([sys.executable, "-m", "optuav", "sweep", str(file)])
        while done.poll() is None and len([*directory.glob("part-*")]) < wanted:
            time.sleep(0.001)
        time.sleep(draw.random() * (0.05 if wanted else 2.0))
        done.kill()
        assert done.wait() == -signal.SIGKILL, "it had ended before"
        there = len([*directory.glob("part-*")])
        for name, part in content(directory).items() if directory.exists() else ():
            assert name == files.TEMPORARY or part == expected[name], "a part is not whole"
    assert 0 < there < parts
    assert optuav.sweep(file).kept == there
    assert content(directory) == expected


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
def test_two_kills_leave_the_same_bytes(tmp_path: Path) -> None:
    kills(tmp_path, 2, 20, seed=1)


@pytest.mark.soak
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
def test_twenty_kills_leave_the_same_bytes(tmp_path: Path) -> None:
    kills(tmp_path, 20, 400, seed=random.SystemRandom().randrange(10**6))


def test_a_full_disk_is_one_error_and_breaks_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the middle of the second part; with room again the command ends with the same bytes."""
    expected = content(optuav.sweep(study(tmp_path, GRID, "whole")).directory)
    file, directory = study(tmp_path, GRID, "full"), tmp_path / "full"
    write, room = os.write, [len(expected["manifest.json"]) + len(expected["part-000000.parquet"])]

    def filling(number: int, data: Any) -> int:
        if not room[0]:
            raise OSError(28, "No space left on device")
        written = write(number, data[: room[0]])
        room[0] -= written
        return written

    room[0] += 1000
    monkeypatch.setattr(files.os, "write", filling)
    with pytest.raises(InputError, match=r"part-000001\.parquet: cannot be written: No space left"):
        optuav.sweep(file)
    monkeypatch.undo()
    assert content(directory).items() < expected.items()
    assert optuav.sweep(file).kept == 1
    assert content(directory) == expected


# What is refused


def test_all_faults_of_a_study_are_said_at_once(tmp_path: Path) -> None:
    """Before anything is computed or written."""
    text = """
    perspective = ["battery", "avail"]
    problem = { name = "P1", trajectory = "x" }
    scenarios_per_part = 0
    colour = 3
    [grid]
    limits.deadline_s = { low = 600, high = 18, count = 7 }
    limits.min_soc = [2.0]
    battery.nonsense = [1]
    battery.capacity_As = []
    [paired]
    body.mass_kg = [1.0, 2.0]
    "link.device_m[0]" = [1.0]
    [samples]
    cuont = 30
    seed = -1
    battery.packs = { percent = 10 }
    """
    with pytest.raises(InputError) as refused:
        optuav.sweep(study(tmp_path, text))
    keys = [fault.key for fault in refused.value.faults]
    assert sorted(keys) == sorted(
        [
            *("perspective", "trajectory", "scenarios_per_part", "colour", "paired", "samples"),
            *("grid.limits.deadline_s", "grid.limits.min_soc", "grid.battery.nonsense"),
            *("grid.battery.capacity_As", "samples.count", "samples.cuont", "samples.seed"),
            "samples.battery.packs",
        ]
    )
    assert {Path(fault.source).name for fault in refused.value.faults} == {"study.toml"}
    assert not (tmp_path / "study").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "must have values, or"),
        ('mission = "papr"\ngrid.limits.deadline_s = [9]', "no such file; did you mean 'paper'"),
        (
            "mission = 3\ngrid.limits.deadline_s = [9]",
            "mission = 3: must be a shipped mission's name",
        ),
        ("perspective = []\ngrid.limits.deadline_s = [9]", "one perspective, or a list"),
        ("grid = 3", "grid = 3: must be a table"),
        (
            'output = ""\ngrid.limits.deadline_s = [9]',
            "output = '': must be the path of a directory",
        ),
        ('problem = "P4"\ngrid.limits.deadline_s = [9]', "needs the name of a building"),
        (
            "problem.colour = 3\ngrid.limits.deadline_s = [9]",
            "colour = 3: problem P1 takes no colour",
        ),
        (
            "grid.limits.deadline_s = [9]\npaired.limits.deadline_s = [9]",
            "in one of the tables only",
        ),
        (
            '[grid]\nlimits.deadline_s = [9, 8]\n"limits.deadline_s" = [1]',
            r"grid\.limits\.deadline_s: must be set once",
        ),
        ("samples.count = 3", "at least one key"),
        ("samples.battery.capacity_As = { percent = 3 }", "samples.count: must be a whole number"),
        ("grid.laser.wavelength_nm = [900]", "810 or 1550 nm"),
        (
            "grid.laser.wavelength_nm = [810]\npaired.laser.emitter_slope = [0.3]",
            "with all of emitter_slope",
        ),
        (
            "samples = { count = 10_000_000, body.mass_kg = { percent = 1 } }\n"
            "grid.limits.deadline_s = { low = 1, high = 2, count = 101 }",
            "1010000000 scenarios: must be at most 1000000000",
        ),
        (
            "scenarios_per_part = 9\n"
            "grid.limits.deadline_s = { low = 1, high = 2, count = 1_000_000 }",
            "scenarios_per_part = 9: must be at least 10",
        ),
    ],
)
def test_faults_of_studies(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        optuav.sweep(study(tmp_path, text))
    assert not (tmp_path / "study").exists()


def test_a_missing_mission_hides_no_other_fault(tmp_path: Path) -> None:
    text = 'mission = "nosuch.toml"\nperspective = "foo"\ngrid.limits.deadline = [9]\n'
    text += "samples = { count = 0, limits.min_soc.percent = 1 }"
    with pytest.raises(InputError) as refused:
        optuav.sweep(study(tmp_path, text))
    keys = [fault.key for fault in refused.value.faults]
    assert sorted(keys) == ["", "grid.limits.deadline", "perspective", "samples.count"]


def test_a_sweep_goes_on_with_the_same_table_of_buildings_alone(tmp_path: Path) -> None:
    roofs = tmp_path / "roofs.csv"
    roofs.write_text("name,x_m,y_m,z_m\na,900,1500,60\n")
    mission = 'schema = 1\nextends = "paper"\nbuildings_file = "roofs.csv"\n'
    (tmp_path / "block.toml").write_text(mission)
    file = study(tmp_path, f'mission = "block.toml"\n{GRID}')
    directory = optuav.sweep(file).directory
    before = content(directory)
    optuav.sweep(file)
    assert content(directory) == before
    roofs.write_text("name,x_m,y_m,z_m\na,900,1500,61\n")
    with pytest.raises(InputError, match="contains the parts of another study"):
        optuav.sweep(file)
    assert content(directory) == before


def test_a_directory_of_anything_else_is_left_alone(tmp_path: Path) -> None:
    """Another study, other versions, other files, or a file of its name."""
    file = study(tmp_path, GRID)
    directory = optuav.sweep(file).directory
    before = content(directory)
    file.write_text(GRID.replace("1230", "1231"))
    with pytest.raises(InputError, match="contains the parts of another study: set another output"):
        optuav.sweep(file)
    file.write_text(GRID)
    manifest = directory / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"numpy": "', '"numpy": "0.'))
    with pytest.raises(InputError, match=r"numpy = .*: 0\.\S+, the version that began the sweep"):
        optuav.sweep(file)
    manifest.write_bytes(b"{}")
    with pytest.raises(InputError, match="is not a manifest of a sweep"):
        optuav.sweep(file)
    for foreign in (b"hello", b"\xff\xfe", b'{"name": "a web page"}', b""):
        manifest.write_bytes(foreign)
        for call, path in ((optuav.sweep, file), (optuav.open_sweep, directory)):
            with pytest.raises(InputError, match="is not from optuav and stays"):
                call(path)
        assert manifest.read_bytes() == foreign
    manifest.unlink()
    with pytest.raises(InputError, match="is not empty, and contains no sweep"):
        optuav.sweep(file)
    before.pop("manifest.json")
    assert content(directory) == before
    with pytest.raises(InputError, match="is not a directory"):
        optuav.sweep(study(tmp_path, f'output = "study.toml"\n{GRID}', "other"))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("grid", {"limits.deadline_s": [1, 2, 3, 4, 5], "battery.capacity_As": [3e3, 36e3, 30e3]}),
        ("grid", 3),
        ("grid", {}),
        ("study", 3),
        ("rows", "x"),
        ("versions", 3),
        ("versions", {"nosuch": "1"}),
    ],
)
def test_a_manifest_that_was_edited_is_refused(name: str, value: object, tmp_path: Path) -> None:
    """Nobody finds answers beside values of which they are not the answers."""
    file = study(tmp_path, GRID)
    manifest = optuav.sweep(file).directory / "manifest.json"
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), name: value}))
    for call, path in ((optuav.sweep, file), (optuav.open_sweep, manifest.parent)):
        with pytest.raises(InputError, match=r"manifest\.json: is damaged"):
            call(path)


STRANGE = ("fifo", "link to zero", "link", "directory", "sparse")


@pytest.mark.skipif(sys.platform == "win32", reason="makes pipes and links")
@pytest.mark.parametrize("kind", STRANGE)
@pytest.mark.parametrize("name", ["part-000001.parquet", "manifest.json"])
def test_only_regular_files_of_a_sweep_are_opened(name: str, kind: str, tmp_path: Path) -> None:
    """No pipe or device is waited for, and no link leads a sweep to read or write elsewhere."""
    file, foreign = study(tmp_path, GRID), tmp_path / "foreign"
    path = optuav.sweep(file).directory / name
    foreign.write_bytes(path.read_bytes())
    path.unlink()
    {
        "fifo": lambda: os.mkfifo(path),
        "link to zero": lambda: path.symlink_to("/dev/zero"),
        "link": lambda: path.symlink_to(foreign),
        "directory": path.mkdir,
        "sparse": lambda: os.truncate(os.open(path, os.O_CREAT | os.O_RDWR), 10**12),
    }[kind]()
    before, listed = foreign.read_bytes(), sorted(path.parent.iterdir())
    for call, source in ((optuav.sweep, file), (optuav.open_sweep, path.parent)):
        with pytest.raises(
            InputError, match=rf"{name}: is (no regular|not a reg|a link, not a|a dir|larger)"
        ):
            call(source)
    with pytest.raises(
        InputError, match=rf"{name}: is (no regular|not a reg|a link, not a|a dir|larger)"
    ):
        optuav.sweep(file, resume=False)
    assert (foreign.read_bytes(), sorted(path.parent.iterdir())) == (before, listed)


@pytest.mark.skipif(sys.platform == "win32", reason="makes links")
def test_a_part_is_never_written_through_a_link(tmp_path: Path) -> None:
    """Neither through one that comes while others are computed, nor into a file of two names."""
    foreign, names = tmp_path / "foreign", [tmp_path / "soft", tmp_path / "hard"]
    foreign.write_bytes(b"foreign")
    names[0].symlink_to(foreign)
    names[1].hardlink_to(foreign)
    with pytest.raises(InputError, match="soft: is a link, not a regular file"):
        files.write_own(names[0], b"own")
    files.write_own(names[1], b"own")
    assert (foreign.read_bytes(), names[1].read_bytes()) == (b"foreign", b"own")


FORGED = [
    {"study": {"scenarios_per_part": 0}},
    {"study": {"scenarios_per_part": 1}, "rows": 10**15},
    {"rows": -3},
    {"rows": True},
    {"grid": {"limits.deadline_s": []}},
    {"grid": {"perspective": [1.0]}},
    {"grid": {"limits.deadline_s": ["x"]}},
    {"study": {"perspective": ["x"]}},
    {"study": {"problem": {"name": "P4"}}},
    {"study": {"mission": {"name": "paper", "buildings": [3]}}},
    {"study": {"mission": None}},
]


@pytest.mark.parametrize("change", FORGED)
def test_a_forged_manifest_is_refused_in_words(change: dict[str, Any], tmp_path: Path) -> None:
    """Also one that states its own hash: no error of Python's, and an answer at once."""
    manifest = optuav.sweep(study(tmp_path, GRID)).directory / "manifest.json"
    stated = json.loads(manifest.read_text())
    forged = {**stated, **change, "study": {**stated["study"], **change.get("study", {})}}
    content = json.dumps([forged[name] for name in ("rows", "grid", "study")]).encode()
    forged["hash"] = hashlib.sha256(content).hexdigest()
    manifest.write_text(json.dumps(forged))
    with pytest.raises(InputError, match=r"manifest\.json: is damaged"):
        optuav.open_sweep(manifest.parent)


def test_a_forged_part_is_refused_before_it_takes_memory(tmp_path: Path) -> None:
    """One that has the right hash, and a billion lines in a few bytes, or no number for a time."""
    import pyarrow as pa
    from pyarrow import parquet

    directory = optuav.sweep(study(tmp_path, GRID)).directory
    part = directory / "part-000000.parquet"
    table = parquet.read_table(part)
    words = pa.array(["x"] * 14)
    for forged in (
        pa.concat_tables([table] * 3),
        table.drop_columns("hover_time_s"),
        table.set_column(0, table.column_names[0], words),
        table.set_column(table.column_names.index("reason"), "reason", words),
        table.append_column("extra", pa.array([1.0] * 14)),
    ):
        parquet.write_table(forged, part)
        mark = next(v for v in forged.schema.metadata.values() if len(v) > 128).decode()
        part.write_bytes(_sealed(part.read_bytes(), mark[: mark.rindex(" ") + 1]))
        with pytest.raises(InputError, match="is damaged, or from another version of optuav"):
            optuav.open_sweep(directory)


def test_a_tilde_in_a_study_is_the_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a shell, where a study states its mission or its output; no directory is named ~."""
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("USERPROFILE", str(home))
    optuav.load("paper").save(home / "mine.toml")
    stated = 'mission = "~/mine.toml"\noutput = "~/parts"\ngrid.limits.deadline_s = [600, 900]'
    assert optuav.sweep(study(tmp_path, stated)).directory == home / "parts"
    assert (home / "parts" / "manifest.json").is_file()
    assert not (tmp_path / "~").exists()


def test_what_is_no_path_is_refused() -> None:
    for call in (optuav.sweep, optuav.open_sweep):
        with pytest.raises(InputError, match="None: must be a path"):
            call(None)  # type: ignore[operator]
    with pytest.raises(InputError, match=r"output = '~nobody-here': there is no user"):
        optuav.sweep({"output": "~nobody-here", "grid": {"limits": {"deadline_s": [600]}}})
    with pytest.raises(InputError, match=r"study: hover_time_s = 'a DataArray': unknown key"):
        optuav.sweep(optuav.batch("paper", {"limits.deadline_s": [600.0]}))


def test_what_cannot_be_opened_is_refused(tmp_path: Path) -> None:
    """No sweep, and one that is not finished."""
    with pytest.raises(InputError, match="no such file"):
        optuav.open_sweep(tmp_path)
    directory = optuav.sweep(study(tmp_path, GRID)).directory
    part = directory / "part-000001.parquet"
    part.unlink()
    with pytest.raises(InputError, match="not finished: 1 of 3 parts are missing or damaged"):
        optuav.open_sweep(directory)


def test_a_checkout_that_is_not_installed_sweeps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its manifest says so; it goes on with its own sweep."""

    def version(package: str) -> str:
        if package == "optuav":
            raise PackageNotFoundError(package)
        return installed(package)

    installed = metadata.version
    monkeypatch.setattr(metadata, "version", version)
    assert optuav.__version__ == "not installed"
    for _ in range(2):
        swept(tmp_path, "grid.limits.deadline_s = [600, 900]\n")
    (manifest,) = tmp_path.glob("*/manifest.json")
    assert json.loads(manifest.read_text())["versions"]["optuav"] == "not installed"


def test_a_named_engine_solves_every_scenario_by_itself(tmp_path: Path) -> None:
    """In continuous times as the bracket, in slots as `solve` with the slots of each scenario."""
    text = "grid.limits.deadline_s = [600, 900]\ngrid.limits.slot_s = [1, 20]"
    known = optuav.open_sweep(optuav.sweep(study(tmp_path, text)))
    by_casadi = optuav.open_sweep(optuav.sweep(study(tmp_path, f'engine = "casadi"\n{text}', "c")))
    np.testing.assert_allclose(by_casadi.hover_time_s, known.hover_time_s, atol=1e-4)
    in_slots = optuav.open_sweep(optuav.sweep(study(tmp_path, f'engine = "grid"\n{text}', "g")))
    for deadline_s, slot_s in itertools.product((600, 900), (1, 20)):
        keys = {"limits.deadline_s": deadline_s, "limits.slot_s": slot_s}
        plan = optuav.solve(optuav.load("paper").replace(keys), engine="grid")
        assert in_slots.hover_time_s.sel(keys).item() == plan.hover_time_s


class Counting(ClosedForm):
    """The closed form under a name of its own, which counts what it is asked."""

    name = "counting"
    asked = 0

    def solve(self, *arguments: Any, **named: Any) -> Any:
        """The same answer."""
        Counting.asked += 1
        return super().solve(*arguments, **named)


def test_an_engine_of_ones_own_is_used_by_its_name(tmp_path: Path) -> None:
    text = 'perspective = "battery"\ngrid.limits.deadline_s = [600, 900]'
    optuav.register(Counting())
    try:
        own = optuav.open_sweep(optuav.sweep(study(tmp_path, f'engine = "counting"\n{text}')))
    finally:
        optuav.unregister("counting")
    assert Counting.asked >= 2
    known = optuav.open_sweep(optuav.sweep(study(tmp_path, text, "known")))
    np.testing.assert_allclose(own.hover_time_s, known.hover_time_s, atol=1e-5)


@pytest.mark.parametrize(
    ("engine", "words"),
    [
        ("casad", "engine = 'casad': must be one of auto, .*did you mean 'casadi'"),
        ("closed-form", "engine closed-form does not accept this model"),
    ],
)
def test_an_engine_that_cannot_answer_is_refused_before_the_work(
    engine: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=words):
        optuav.sweep(study(tmp_path, f'engine = "{engine}"\ngrid.limits.deadline_s = [600]'))
    assert not (tmp_path / "study").exists()
