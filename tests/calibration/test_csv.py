"""Files of measurements: units in the header, and clear words for what is wrong."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from optuav.calibration import fit_kibam
from optuav.calibration.csv import (
    Format,
    Measurements,
    gaps,
    read_all,
    record_faults,
)
from optuav.errors import InputError

OPTIONAL = {"speed": "rotor speed", "phase": "text", "duration": "time"}
KINDS = {"time": "time", "current": "current"} | OPTIONAL
LOG = Format(KINDS, tuple(OPTIONAL), ("duration",))


def record(table: Measurements) -> None:
    """Refuse what is no record over time."""
    if found := [*record_faults(table), *gaps(table)]:
        raise InputError(found)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "log.csv"


def table_of(file: Path, *formats: Format) -> Measurements:
    """What is read of a single file."""
    return read_all([file], formats, lambda table: table)[1][0]


def faults(file: Path, text: str, least: int = 1) -> list[str]:
    file.write_text(text, "utf-8")
    with pytest.raises(InputError) as caught:
        record(table_of(file, LOG._replace(least=least)))
    return [str(fault).replace(str(file), "log.csv") for fault in caught.value.faults]


def test_units_of_the_header_become_si(file: Path) -> None:
    """Minutes, milliamperes and turns; remarks and empty lines do not count."""
    file.write_text(
        "# a remark\ntime_min, current_mA,speed_rpm,phase\n1,500,60,hover\n\n2,5e2,0,rest\n"
    )
    table = table_of(file, LOG)
    assert table.numbers["time"].tolist() == [60.0, 120.0]
    assert table.numbers["current"].tolist() == [0.5, 0.5]
    assert table.numbers["speed"][0] == pytest.approx(2.0 * math.pi)
    assert table.texts["phase"] == ("hover", "rest")
    assert table.lines == (3, 5)


def test_a_blank_is_no_number_where_blanks_are_allowed(file: Path) -> None:
    file.write_text("time_s,current_A,duration_s\n0,1,\n1,1,2\n")
    assert np.isnan(table_of(file, LOG).numbers["duration"][0])


def test_all_faults_come_at_once(file: Path) -> None:
    """Gap, NaN, text, infinity, a short line and absurd sizes: one fault a rule, with its lines."""
    text = "time_s,current_A\n0,1\n1,\n2,nan\n3,much\n4,inf\n5\n6,1e300\n7,-1e-300\n"
    assert faults(file, text) == [
        "log.csv, line 7: cells = 1: must be as many as in the header, 2",
        "log.csv, lines 3 to 6, 8, 9: current_A = an empty cell, …, -1e-300: "
        "must be a number, 0 or 1e-9 to 1e10 in SI units",
    ]


def test_a_gap_among_words_asks_for_a_word(file: Path) -> None:
    text = "time_s,current_A,phase\n0,1,rest\n1,1,\n"
    assert faults(file, text) == ["log.csv, line 3: phase = an empty cell: must be a word"]


@pytest.mark.parametrize(
    ("header", "words"),
    [
        (
            "time_s,current_V",
            "column = 'current_V': must have a unit that belongs to it, current_A or current_mA",
        ),
        ("time_s,current", "column = 'current': must have a unit that belongs to it"),
        (
            "time,current_A",
            "column = 'time': must have a unit that belongs to it, time_s or time_ms",
        ),
        ("time_s,curent_A", "did you mean 'current_A'?"),
        ("time_s,current_A,current_mA", "a second column of current"),
        ("time_s,phase", "there is no column current_A or current_mA"),
        ("time_s;current_A", "'time_s;current_A': must have commas between the columns"),
    ],
)
def test_headers_that_do_not_do(header: str, words: str, file: Path) -> None:
    cells = ",".join(["1"] * (header.count(",") + 1))
    assert any(words in fault for fault in faults(file, f"{header}\n{cells}\n"))


def test_too_few_lines_and_empty_files(file: Path) -> None:
    assert "at least 5 lines" in faults(file, "time_s,current_A\n0,1\n1,1\n", least=5)[0]
    assert "a header and lines" in faults(file, "# nothing\n")[0]


@pytest.mark.parametrize(
    "number", ["1_0", "\N{FULLWIDTH DIGIT ONE}", "0x1", "1e", "+-1", "infinity"]
)
def test_a_number_has_plain_digits(number: str, file: Path) -> None:
    """What Python alone takes for a number is none."""
    assert "a number, 0 or 1e-9" in faults(file, f"time_s,current_A\n0,{number}\n")[0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s,current_A\n0," + "1" * 140_000, "line 2: has more than 10000 characters"),
        ("x," * 4_900 + "\n1\n", "column = 'x': must be a known column"),
        (
            "time_s,current_A\n" + "1\n" * 1_000_000,
            "cells = 1: must be as many as in the header, 2",
        ),
        ("\x1b[31m,\x1b]0;x\x07\n1,2\n", "column = '\\x1b[31m': must be a known column"),
        (
            "time_s,current_A\n0,\x1b[31m\n",
            "current_A = \N{REPLACEMENT CHARACTER}[31m: must be a number",
        ),
        (b"time_s\xff", "is not text in UTF-8: byte 0xff at 6"),
        ("time_s,current_A\n0," + "9" * 5000 + "\n", "current_A = 999"),
        ("a" * 20_000_001, "larger than the 20 MB"),
    ],
    ids=["cell", "columns", "lines", "heading", "escape", "bytes", "digits", "size"],
)
def test_a_hostile_file_gets_a_short_answer(text: str | bytes, words: str, file: Path) -> None:
    """However long or wild its content, the message is short and safe to print."""
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(InputError) as caught:
        table_of(file, LOG)
    said = str(caught.value)
    assert words in said
    assert len(said) < 20_000
    assert all(line.isprintable() for line in said.split("\n"))


def test_clocks_and_gaps_of_a_record(file: Path) -> None:
    """A step of more than ten usual ones is a gap; the clock must move on."""
    rows = "".join(f"{time_s},1\n" for time_s in (0, 1, 2, 3, 20, 21, 21, 20, 22, 23))
    found = faults(file, f"time_s,current_A\n{rows}")
    assert found == [
        "log.csv, lines 8, 9: time = 21 s, 20 s: later than the line before",
        "log.csv, line 6: time = 20 s: no gap of more than 10 usual steps of 1 s before",
    ]


def test_faults_of_several_files_come_read_all(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text("time_s\n1\n")
    paths = [tmp_path / name for name in ("a.csv", "b.csv", "missing.csv")]
    with pytest.raises(InputError) as caught:
        read_all(paths, [LOG], lambda table: table)
    assert len(caught.value.faults) == 3
    assert "there is no such file" in str(caught.value.faults[-1])


def test_lines_that_break_one_rule_are_one_fault(file: Path) -> None:
    """Lines that follow each other are named by their ends."""
    text = "time_s,current_A\n" + "0,\n" * 7 + "0,much\n0,1\n0,\n"
    assert faults(file, text) == [
        "log.csv, lines 2 to 9, 11: current_A = an empty cell, much: "
        "must be a number, 0 or 1e-9 to 1e10 in SI units"
    ]


def test_many_values_with_one_fault_are_one_fault(file: Path) -> None:
    """A record from its end to its start, and many unlike cells, take one line each."""
    reversed_ = "".join(f"{400 - n},1\n" for n in range(300))
    assert faults(file, f"time_s,current_A\n{reversed_}") == [
        "log.csv, lines 3 to 301: time = 399 s, …, 101 s: later than the line before"
    ]
    unlike = "".join(f"{n},{'no' * (n % 2)}{n}\n" for n in range(20))
    assert faults(file, f"time_s,current_A\n{unlike}") == [
        "log.csv, lines 3, 5, 7, 9, 11 and 5 more: current_A = no1, …, no19: "
        "must be a number, 0 or 1e-9 to 1e10 in SI units"
    ]


def test_the_format_with_most_headings_is_read(file: Path) -> None:
    """And the first of several that have as many."""
    other = Format({"time": "time", "force": "force"})
    file.write_text("time_s,force_g\n1,1000\n")
    assert table_of(file, LOG, other).numbers["force"] == pytest.approx([9.80665])
    file.write_text("time_s,phase\n1,rest\n")
    with pytest.raises(InputError, match="there is no column current_A"):
        table_of(file, other, LOG)


def test_no_file_at_all() -> None:
    with pytest.raises(InputError, match=r"files = \[\]: must be a path, or several"):
        fit_kibam([])


def test_a_file_counts_once_under_all_its_names(tmp_path: Path) -> None:
    """By another path, through a link and as a copy too; faults of other files come beside."""
    (tmp_path / "a.csv").write_text("time_s\n1\n")
    (tmp_path / "other.csv").write_text("time_s\n2\n")
    (tmp_path / "copy.csv").write_text("time_s\n1\n")
    (tmp_path / "below").mkdir()
    (tmp_path / "link.csv").symlink_to(tmp_path / "a.csv")
    again = ["below/../a.csv", "link.csv", "copy.csv"]
    paths = [tmp_path / name for name in ("a.csv", "other.csv", *again, "missing.csv")]
    with pytest.raises(InputError) as caught:
        read_all(paths, [Format({"time": "time"})], lambda table: table)
    *twice, missing = map(str, caught.value.faults)
    assert [words.partition(": ")[0] for words in twice] == [str(each) for each in paths[2:5]]
    assert all(f"has the content of {paths[0]}: name each" in words for words in twice)
    assert "there is no such file" in missing
