"""Damaged files of every kind: read, or refused by one clear error."""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest

import optuav
from optuav.calibration import csv, kibam, regimes, rotor
from optuav.calibration.table import read_table
from optuav.errors import LONGEST_WORDS, MOST_SHOWN
from optuav.studies.samples import spreads
from tests.cli.run import run
from tests.mission.strategies import HOSTILE_VALUES, SHIPPED_FILES, TOKENS

DATA = Path(__file__).parents[1] / "examples" / "data"
UNCERTAINTY = b"""[battery]
capacity_As = { percent = 5 }
flow_rate_per_s = { low = 1e-4, likely = 2e-4, high = 3e-4, along = ["battery.available_fraction"] }
[link]
rice_factor = { deviation = 0.5 }
"""
ITINERARY = b"""schema = 1
mission = "paper"
[[stops]]
at = "b1"
kind = "rest"
duration_s = 50
[[stops]]
at = "hover"
kind = "hover"
duration_s = 300
"""
LOG = b"time_s,current_A,power_W,phase\n" + b"".join(b"%d,20,220,hover\n" % n for n in range(12))
CELLS = [
    *(b"", b"1_0", b"nan", b"-inf", b"1e999", b"-1", b"0", b"1e300", b"0x10", b"1" * 5000),
    b"x" * 140_000,
    *("\N{FULLWIDTH DIGIT ONE}".encode(), b'"', b'"a\n', b"\x00", b"\x1b[31m", b"\xff", b"#", b";"),
]
VALUES = [each.encode() for each in HOSTILE_VALUES]
VALUES += [b"1e20", b"1e7", b'"\\u001b[31m"', b"null", b"-1e300"]


def damaged(chance: random.Random, content: bytes) -> bytes:
    """A file with one or two injuries: to bytes, a line, a cell or a value."""
    for _ in range(chance.randint(1, 2)):
        kind = chance.randrange(5)
        if kind == 0:
            start = chance.randrange(len(content) + 1)
            end = start + chance.choice((0, 1, 2, 5, 40))
            instead = chance.choice((b"", content[start:end] * 2, chance.randbytes(2), *TOKENS))
            content = content[:start] + instead + content[end:]
            continue
        lines = content.splitlines(keepends=True) or [b""]
        at = chance.randrange(len(lines))
        line = lines[at]
        if kind == 1:
            del lines[at]
        elif kind == 2:
            lines.insert(chance.randrange(len(lines)), line)
        elif kind == 3:
            cells = line.split(b",")
            cells[chance.randrange(len(cells))] = chance.choice(CELLS)
            lines[at] = b",".join(cells)
        else:
            mark = b"=" if b"=" in line else b":"
            key, _, rest = line.partition(mark)
            end = b",\n" if rest.rstrip().endswith(b",") else b"\n"
            lines[at] = key + mark + b" " + chance.choice(VALUES) + end
        content = b"".join(lines)
    return content


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    file = tmp_path_factory.mktemp("plan") / "plan.json"
    optuav.solve("paper", perspective="battery").save(file)
    return file.read_bytes()


def table(
    one: Callable[[csv.Measurements], object], *formats: csv.Format
) -> Callable[[Path], object]:
    """The reader of a CSV file by its path."""
    return lambda path: csv.read_all([path], formats, one)


READERS: dict[str, tuple[list[bytes], Callable[[Path], object], tuple[str, ...]]] = {
    "mission.toml": (SHIPPED_FILES, optuav.load, ("validate",)),
    "uncertainty.toml": (
        [UNCERTAINTY],
        lambda path: spreads(optuav.load("paper"), path),
        ("sensitivity", "paper", "--samples", "10", "--uncertainty"),
    ),
    "table.toml": ([(DATA / "paper_table2.toml").read_bytes()], read_table, ()),
    "itinerary.toml": ([ITINERARY], lambda path: str(optuav.audit(path)), ("audit",)),
    "plan.json": ([], lambda path: optuav.load_plan(path).summary(), ("show",)),
    "lifetimes.csv": (
        [(DATA / "lifetimes.csv").read_bytes()],
        table(kibam._discharges, *kibam.FORMATS),
        ("calibrate", "kibam"),
    ),
    "log.csv": ([LOG], table(regimes._read_log, regimes.LOG), ("calibrate", "regimes")),
    "bench.csv": (
        [(DATA / "bench.csv").read_bytes()],
        table(rotor._checked, rotor.BENCH, rotor.SHEET),
        ("calibrate", "rotor"),
    ),
}


@pytest.mark.parametrize("count", [30, pytest.param(100_000, marks=pytest.mark.soak)])
@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_is_read_or_refused(
    name: str,
    count: int,
    plan: bytes,
    tmp_path: Path,
    record_property: Callable[[str, object], None],
) -> None:
    """The error is short and safe to print; nothing else is raised, and nothing is warned of."""
    seeds, read, _ = READERS[name]
    chance, path, refused = random.Random(f"{name} {count}"), tmp_path / name, 0
    for number in range(count):
        path.write_bytes(content := damaged(chance, chance.choice(seeds or [plan])))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                read(path)
        except optuav.InputError as error:
            refused += 1
            lines = str(error).split("\n")
            assert len(lines) <= MOST_SHOWN + 1
            assert all(line.isprintable() and len(line) < 3 * LONGEST_WORDS for line in lines)
        except Exception as error:
            raise AssertionError(f"{name} {number}: {error!r} of {content!r}") from error
    assert 0.2 * count < refused
    assert refused < count or count < 100
    record_property("count", f"{count} damaged files {name}, {refused} of them refused")


@pytest.mark.soak
@pytest.mark.parametrize("name", READERS)
def test_a_command_reads_a_damaged_file_or_says_why_not(
    name: str, plan: bytes, tmp_path: Path
) -> None:
    """By an exit code that is documented, without a traceback or an escape (see `run`)."""
    seeds, _, command = READERS[name]
    chance, path = random.Random(name), tmp_path / name
    for _ in range(300 if command else 0):
        path.write_bytes(damaged(chance, chance.choice(seeds or [plan])))
        found = run(*command, str(path))
        assert len(found.err) < 50_000
        if name == "plan.json":
            run("show", str(path), "--plot", str(tmp_path / "pictures"), "--force")
