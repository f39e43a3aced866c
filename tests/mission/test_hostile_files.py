"""Files that are careless, damaged or malicious: one clear error, never another exception."""

from __future__ import annotations

import os
import tomllib
from collections import deque
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from optuav.errors import MOST_SHOWN, InputError
from optuav.mission import Mission, load
from optuav.mission.files import LARGEST_TOML, MOST_PARTS
from tests.mission.strategies import mutated_toml

HEAD = 'schema = 1\nextends = "paper"\n'


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file to write over and over."""
    return tmp_path_factory.mktemp("hostile") / "mission.toml"


def mission_or_error(path: Path) -> Mission | InputError:
    """What `load` makes of a file."""
    try:
        return load(path)
    except InputError as error:
        return error


def refusal(path: Path, content: str | bytes) -> InputError:
    """The error that a file with this content gives."""
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(InputError) as caught:
        load(path)
    return caught.value


@pytest.mark.campaign
@settings(suppress_health_check=[HealthCheck.too_slow])
@given(content=mutated_toml())
def test_a_damaged_file_is_refused_in_words_or_is_a_mission(scratch: Path, content: bytes) -> None:
    """Whatever a file holds: the error names a place and what is allowed there, and is safe to
    print; a mission that comes out survives its own data.
    """
    scratch.write_bytes(content)
    outcome = mission_or_error(scratch)
    if isinstance(outcome, Mission):
        assert Mission.from_dict(outcome.to_dict()) == outcome
    else:
        assert outcome.faults
        assert all(fault.allowed and fault.source for fault in outcome.faults)
        lines = str(outcome).split("\n")
        assert len(lines) <= MOST_SHOWN + 1
        assert all(line.isprintable() for line in lines)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "schema"),
        (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", "not text in UTF-8 but a PNG picture"),
        (b"\x00" * 1000, "not TOML"),
        (b"#" * (LARGEST_TOML + 1), "larger than the 2 MB"),
        ("a = " + "[" * 100_000, "nested too deeply"),
        ("a = " + "{a=" * 100_000, "nested too deeply"),
        ("a." * 100_000 + "a = 1", "dotted name of more than 8 parts"),
        ("[" + "'a' . " * 100_000 + "a]", "dotted name of more than 8 parts"),
        (r'"\"".' * 100_000 + "a = 1", "dotted name of more than 8 parts"),
        (HEAD + "a." * (MOST_PARTS - 1) + "a = 1", "unknown key"),
        (HEAD + "".join(f"k{n} = 1\n" for n in range(10_000)), "more than 10000 keys"),
        (HEAD + "limits.deadline_s = " + "9" * 5000, "not TOML"),
        (HEAD + "limits.deadline_s = 0x" + "f" * 5000, "an integer of 20000 bits"),
        (
            HEAD + "limits.deadline_s = " + "9" * 400,
            "an integer of 1329 bits: must be a number, 0 < x",
        ),
        (HEAD + "battery.packs = " + "9" * 400, "a whole number, 1 <= x <= 1000"),
        (
            HEAD + "limits.deadline_s = 1\nlimits.deadline_s = 2",
            "key or a table appears twice",
        ),
        (HEAD + 'description = "\\ud800"', "not TOML"),
        (
            HEAD + 'name = "\\u0000"',
            "name = '\\x00': must be a string of 1 to 200 printable characters",
        ),
        (HEAD + 'name = "' + "x" * 100_000 + '"', "a string of 1 to 200 printable characters"),
        (HEAD + '"\\u001b[31m" = 1', "\N{REPLACEMENT CHARACTER}[31m = 1: unknown key"),
        (HEAD + "x" * 100_000 + " = 1", "xxx... = 1: unknown key"),
        (HEAD + "limits = 3", "limits = 3: must be a table [limits] with deadline_s"),
        (HEAD + "[[limits]]", "limits = [an empty table]: must be a table [limits]"),
        (HEAD + "buildings = 3", "buildings = 3: must be up to 100000 tables [[buildings]]"),
        (
            HEAD + "buildings = [3]",
            "buildings[0] = 3: must be a table [[buildings]] with name, position_m",
        ),
        (HEAD + "[buildings]", "buildings = an empty table: must be up to 100000 tables"),
        (
            HEAD + "limits.deadline_s = 2020-02-29",
            "limits.deadline_s = 2020-02-29: must be a number",
        ),
        (HEAD + "limits.deadline_s = []", "limits.deadline_s = []: must be a number"),
        (HEAD + "limits.deadline_s.x = 1", "limits.deadline_s = a table: must be a number"),
        (HEAD + "limits.deadline_s = true", "limits.deadline_s = true: must be a number"),
        (HEAD + "limits.deadline_s = nan", "limits.deadline_s = nan: must be a number"),
        (HEAD + "limits.deadline_s = 1e999", "limits.deadline_s = inf: must be a number"),
        (
            HEAD + "route.origin_m = [1, 'a', true]",
            "[1, 'a', true]: must be three numbers [x, y, z]",
        ),
        (HEAD + "route.origin_m = [1, 2]", "[1, 2]: must be three numbers [x, y, z]"),
        (HEAD + "flight = 3", "flight = 3: must be a table [flight]"),
        (HEAD + "flight.model = 3", 'flight.model = 3: must be "rotors" or "regimes"'),
        (HEAD + "flight.model = []", 'flight.model = []: must be "rotors" or "regimes"'),
        (HEAD + "laser.wavelength_nm = []", "laser.wavelength_nm = []: must be a number"),
        (HEAD + "laser = true", "laser = true: must be a table [laser]"),
        (HEAD + "name = 3", "name = 3: must be a string"),
        ('schema = "1"', "schema = '1': 1, the version of this format"),
        ("schema = true", "schema = true: 1, the version of this format"),
        ("schema = 1.0", "schema = 1.0: 1, the version of this format"),
        ("schema = 2\nextends = 'paper'", "schema = 2: 1, the version of this format"),
        (
            "extends = 'paper'",
            "schema: is missing: add the line schema = 1, the version of this format",
        ),
        ("schema = 1\nextends = 3", "extends = 3: must be a shipped mission's name or a path"),
        ("schema = 1\nextends = ''", "is a directory, not a file"),
        (
            "schema = 1\nextends = ['paper']",
            "extends = ['paper']: must be a shipped mission's name",
        ),
        ("schema = 1\nextends = 'papr'", "there is no such file; did you mean 'paper'?"),
        (
            "schema = 1\nextends = '/nowhere/at/all'",
            "shipped missions are matrice350, paper, paper-drag, paper-table2, relay-today",
        ),
        ('schema = 1\nextends = "a\\u0000b"', "is not a possible path"),
        ("schema = 1\nextends = '" + "x" * 5000 + "'", "cannot be read: File name too long"),
    ],
    ids=lambda value: str(value[:40]),
)
def test_one_clear_error(tmp_path: Path, content: str | bytes, words: str) -> None:
    """The message says what is wrong in words that can be acted upon."""
    assert words in str(refusal(tmp_path / "mission.toml", content))


def test_a_file_at_the_largest_size_is_read(tmp_path: Path) -> None:
    """The limit itself is allowed, and comments are not mistaken for rubbish."""
    path = tmp_path / "mission.toml"
    path.write_bytes(HEAD.encode() + b"#" * (LARGEST_TOML - len(HEAD)))
    assert load(path).limits == load("paper").limits


def test_a_byte_order_mark_and_windows_line_ends_are_read(tmp_path: Path) -> None:
    """Files written by an editor on Windows."""
    path = tmp_path / "mission.toml"
    path.write_bytes(
        b"\xef\xbb\xbf" + (HEAD + "limits.deadline_s = 7\n").replace("\n", "\r\n").encode()
    )
    assert load(path).limits.deadline_s == 7.0


def test_dotted_text_is_no_dotted_key(tmp_path: Path) -> None:
    """The guard against deep keys lets numbers and sentences with many dots pass."""
    text = "one. " * 20 + "1.5, " * 100 + "..." * 100 + "a.b.c.d.e.f.g.h.i.j"
    path = tmp_path / "mission.toml"
    for quote in ('"', "'", '"""', "'''"):
        path.write_text(HEAD + f"description = {quote}{text}{quote} # {text}\n", "utf-8")
        assert load(path).description == text


@pytest.mark.parametrize("count", [5_000, pytest.param(100_000, marks=pytest.mark.soak), 100_001])
def test_faults_of_many_buildings_are_all_kept_and_few_are_printed(
    tmp_path: Path, count: int
) -> None:
    """Up to the largest number each building is judged; above it none is."""
    error = refusal(tmp_path / "mission.toml", HEAD + "buildings = [" + "{}," * count + "]")
    assert len(error.faults) == (2 * count if count <= 100_000 else 1)
    lines = str(error).splitlines()
    assert lines[MOST_SHOWN:] == (
        [f"and {2 * count - MOST_SHOWN} more"] if count <= 100_000 else []
    )


def test_suggestions_do_not_hold_up_a_file_of_unknown_keys(tmp_path: Path) -> None:
    """Every unknown key is reported, and the first ones come with a suggestion."""
    content = HEAD + "[limits]\n" + "".join(f"deadlin_{n} = 1\n" for n in range(2000))
    faults = refusal(tmp_path / "mission.toml", content).faults
    assert len(faults) == 2000
    assert faults[0].allowed == "unknown key; did you mean 'deadline_s'?"
    assert faults[-1].allowed == "unknown key"


def test_a_circle_is_named(tmp_path: Path) -> None:
    """Files that extend one another, and one that extends itself through a link."""
    for name, base in (("a", "b"), ("b", "c"), ("c", "a")):
        (tmp_path / f"{name}.toml").write_text(f"schema = 1\nextends = '{base}.toml'\n")
    with pytest.raises(InputError, match=r"a\.toml -> .*b\.toml -> .*c\.toml -> .*a\.toml"):
        load(tmp_path / "a.toml")
    (tmp_path / "link.toml").symlink_to(tmp_path / "self.toml")
    (tmp_path / "self.toml").write_text("schema = 1\nextends = 'link.toml'\n")
    with pytest.raises(InputError, match="does not lead back"):
        load(tmp_path / "self.toml")


def test_an_endless_chain_ends(tmp_path: Path) -> None:
    """A long chain without a circle is refused instead of followed."""
    for n in range(100):
        (tmp_path / f"{n}.toml").write_text(f"schema = 1\nextends = '{n + 1}.toml'\n")
    with pytest.raises(InputError, match="a chain of at most 32 files"):
        load(tmp_path / "0.toml")


def test_a_broken_chain_still_tells_what_is_wrong_above_it(tmp_path: Path) -> None:
    """What the file states itself is judged; what the unread file might state is not missing."""
    error = refusal(
        tmp_path / "mission.toml",
        "extends = 'nowhere.toml'\n[limits]\nmin_soc = 2\ndeadlines = 1\n[laser]\npower_W = 3\n",
    )
    keys = [fault.key for fault in error.faults]
    assert keys == ["extends", "schema", "limits.min_soc", "limits.deadlines"]


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("papr", "papr: there is no such file; did you mean 'paper'?"),
        (
            "no-such-mission",
            "shipped missions are matrice350, paper, paper-drag, paper-table2, relay-today",
        ),
        ("", "is a directory, not a file"),
        (Path("/dev/null"), "is no regular file"),
        ("a\0b", "is not a possible path"),
        ("\udcff\x1b[31m", "there is no such file"),
        (3, "a shipped mission's name or a file's path"),
        (None, "a shipped mission's name or a file's path"),
    ],
)
def test_a_source_that_is_no_mission(source: object, words: str) -> None:
    """Names, paths and objects that lead nowhere."""
    with pytest.raises(InputError) as caught:
        load(source)  # type: ignore[arg-type]
    assert words in str(caught.value)
    assert all(line.isprintable() for line in str(caught.value).splitlines())


def test_a_directory_is_no_mission(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a directory, not a file"):
        load(tmp_path)


def test_a_pipe_is_refused_instead_of_waited_for(tmp_path: Path) -> None:
    """Opening a pipe that nobody writes to would block for ever."""
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(InputError, match="is no regular file"):
        load(tmp_path / "pipe.toml")


def test_no_permission_to_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The system's refusal is passed on in its own words (root is refused nothing: simulated)."""
    path = tmp_path / "mission.toml"
    path.write_text(HEAD)

    def refuse(self: Path, *_: object) -> None:
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(InputError, match=r"mission\.toml: cannot be read: Permission denied"):
        load(path)


def test_tomllib_reads_what_the_guards_let_through(tmp_path: Path) -> None:
    """A dotted key of as many parts as are allowed is parsed as TOML."""
    text = ".".join(["a"] * MOST_PARTS) + " = 1"
    assert tomllib.loads(text)
    assert refusal(tmp_path / "mission.toml", HEAD + text).faults[0].key == "a"


def test_a_number_of_too_many_digits_is_refused_in_our_words(scratch: Path) -> None:
    """Not in Python's, which advise a setting of the interpreter."""
    found = str(refusal(scratch, f"{HEAD}limits.deadline_s = {'9' * 5000}\n"))
    assert found.endswith("is not TOML: a whole number has more than 4300 digits")
    with pytest.raises(InputError, match=r"limits\.deadline_s = a set: must be a number"):
        load("paper").replace({"limits.deadline_s": {10**5000}})
    for address in ({object()}, deque([object()])):
        assert " at 0x" in repr(address)
        with pytest.raises(
            InputError, match=rf"limits\.deadline_s = a {type(address).__name__}: must be"
        ):
            load("paper").replace({"limits.deadline_s": address})


def test_a_very_long_path_is_quoted_by_its_end() -> None:
    """Where the suffix is that is refused."""
    with pytest.raises(InputError) as refusal:
        load("paper").save("1" * 5000 + ".xyz")
    assert len(str(refusal.value)) < 300
    assert "11.xyz'" in str(refusal.value)
