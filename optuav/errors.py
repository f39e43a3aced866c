"""The errors that optuav raises on purpose, and the faults that make an input error."""

import datetime
import difflib
import re
import reprlib
import sys
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import wraps
from importlib import import_module
from typing import Any, TextIO

MOST_SHOWN = 20  # Faults that a message lists one by one
LONGEST_TEXT = 60  # Most characters of a value, and of a name with suggestions
ADDRESS = re.compile(r"x[0-9a-f]{6,}>")
PLAIN = {
    **{"→": "->", "−": "-", "–": "-", "·": "*", "×": "x", "…": "...", "∞": "inf", "√": "sqrt"},
    **{"⁻": "-", "′": "'", "°": " deg", "µ": "u", "λ": "lambda", "Λ": "Lambda", "ϱ": "rho"},
    **{"≤": "<=", "≥": ">=", "≠": "!=", "≈": "~", "∈": "in", "±": "+/-", "∂": "d", "∧": "and"},
}
"""Replacements for signs missing from an encoding."""
EXTRAS = {
    **{"matplotlib": "plot", "pandas": "frame", "xarray": "batch", "pyarrow": "sweep"},
    **{"distributed": "cluster", "anywidget": "notebook"},
    **dict.fromkeys(("geopandas", "rasterio", "pyproj"), "city"),
}
"""The extra of ``pyproject.toml`` by package, where it has another name."""
ALLOWED = re.compile(
    r"(an?|one|two|three|four|some|none|as|either|set|left out|never|at (least|most)|up to|true|"
    r"the (name|path|same|address|form|step)|arrays|axes|columns|longitudes?|numbers|pairs|plans|"
    r"points|pooled|prices|products|stages|tables|values|layouts|of|in|least x|x, y)(?!\w)|"
    r"[A-Z]+[,=.]|[\"'[(|]"
)
"""How words on allowed values begin, unlike a sentence on what is wrong."""
LONGEST_NAME, LONGEST_WORDS = 200, 2000  # Most characters of a name and of a sentence in a message


def decimal(text: str | float) -> float:
    """The number that a text is; of Python's spellings not ``1_0`` and no digits but 0 to 9."""
    if isinstance(text, str) and ("_" in text or not text.isascii()):
        raise ValueError(f"{text!r} is not a number")
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{text!r} is not a number") from None


def integer(text: str | int) -> int:
    """The whole number that a text is, in the spellings of `decimal`."""
    decimal(text)
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"{text!r} is not a whole number") from None


def printable(text: str, kept: str = "") -> str:
    """Text from anywhere without control characters but those kept, safe to print."""
    unsafe = (ord(letter) for letter in {*text} - {*kept} if not letter.isprintable())
    return text.translate(dict.fromkeys(unsafe, "\N{REPLACEMENT CHARACTER}"))


def encodable(text: str, stream: TextIO | None = None) -> str:
    """Return a text with plain signs for those that a stream, or the standard output, cannot show.

    Greek letters become their names, letters with an accent lose it.
    """
    encoding = getattr(stream or sys.stdout, "encoding", None) or "utf-8"

    def plain(letter: str) -> str:
        name = unicodedata.name(letter, "?").split()
        bare = unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode()
        greek = name[-1].lower() if "SMALL" in name else name[-1].title()
        return PLAIN.get(letter) or bare or (greek if name[0] == "GREEK" else "?")

    missing = {x for x in {*text} if not x.isascii() and not x.encode(encoding, "ignore")}
    return text.translate({ord(sign): plain(sign) for sign in missing})


def for_console(write: Callable[[Any], str]) -> Callable[[Any], str]:
    """Return a `__str__` whose text the standard output can show, see `encodable`."""

    @wraps(write)
    def text(self: Any) -> str:
        return encodable(write(self))

    return text


def safe_name(part: object, longest: int = LONGEST_NAME) -> str:
    """A name or a part of a dotted key as it may be printed: the start of a very long one."""
    text = part if isinstance(part, str) else shown(part)
    return printable(text if len(text) <= longest else f"{text[: longest - 3]}...")


def shown(value: object, depth: int = 2) -> str:
    """A value as a short text."""
    match value:
        case float():
            return repr(float(value))
        case bool():
            return "true" if value else "false"
        case int() if value.bit_length() > 200:
            return f"an integer of {value.bit_length()} bits"
        case str() if len(value) > LONGEST_TEXT:
            return f"{value[:LONGEST_TEXT]!r}..."
        case int() | str():
            return repr(value)
        case dict():
            return "a table" if value else "an empty table"
        case type():
            return f"the class {value.__name__}"
        case list() | tuple() if depth == 0:
            return "[...]"
        case list() | tuple():
            items = [shown(item, depth - 1) for item in value[:4]]
            return f"[{', '.join(items + ['...'] * (len(value) > 4))}]"
        case datetime.date() | datetime.time():
            return value.isoformat()
        case object(columns=_, shape=(rows, _)):  # A data frame, whose text is a table
            return f"a {type(value).__name__} of {rows} row{'s' * (rows != 1)}"
        case _:
            with suppress(ValueError):  # of a number of too many digits inside
                text = reprlib.repr(value)
                # No table of many lines, and no address, which differs from run to run
                if text.isprintable() and not text.startswith("<") and not ADDRESS.search(text):
                    return text
            return f"a {type(value).__name__}"


def nearest(key: str, known: Iterable[str]) -> str:
    """Words that suggest the known key most like this one; empty if none is like it.

    Keys of one table are compared only by their names: as a whole, all of them are alike.
    """
    if len(key) > LONGEST_TEXT:
        return ""
    table, dot, name = key.rpartition(".")
    inside = [key_inside for key_inside in known if dot and key_inside.startswith(f"{table}.")]
    beside = [key_inside.removeprefix(f"{table}.") for key_inside in inside]
    if like := difflib.get_close_matches(name, beside, n=1):
        return f"; did you mean '{table}.{like[0]}'?"
    like = difflib.get_close_matches(key, {*known} - {*inside, table}, n=1)
    return f"; did you mean '{like[0]}'?" if like else ""


class OptuavError(Exception):
    """Base of the errors that optuav raises on purpose.

    Examples
    --------
    >>> import optuav
    >>> issubclass(optuav.SolverError, optuav.OptuavError)
    True
    """


@dataclass(frozen=True)
class Fault:
    """One thing wrong with an input.

    Parameters
    ----------
    key
        Dotted name of the field, for example ``"limits.min_soc"``; empty for the input as a whole.
    value
        The refused value as a short text; empty for a missing key.
    allowed
        Allowed values in words, or a sentence on what is wrong.
    source
        File, option or argument that contains the value.

    Examples
    --------
    >>> from optuav import Fault
    >>> print(Fault("limits.min_soc", "2", "a number, 0 <= x < 1 [-]", "town.toml"))
    town.toml: limits.min_soc = 2: must be a number, 0 <= x < 1 [-]
    """

    key: str
    value: str
    allowed: str
    source: str = ""

    @for_console
    def __str__(self) -> str:
        source, value = (safe_name(part, LONGEST_WORDS // 2) for part in (self.source, self.value))
        key, allowed = safe_name(self.key), safe_name(self.allowed, LONGEST_WORDS)
        where = ": ".join(part for part in (source, key) if part)
        what = f" = {value}" if value and key else value
        must = "must be " if ALLOWED.match(allowed) else ""
        return f"{where}{what}: {must}{allowed}" if where or what else allowed


class InputError(OptuavError, ValueError):
    """Input that cannot be used: `faults` lists every fault, and the message shows the first ones.

    Parameters
    ----------
    faults
        Every fault, at least one; or a sentence on the input as a whole.

    Examples
    --------
    >>> import optuav
    >>> try:
    ...     optuav.load("paper").replace({"limits.min_soc": 2, "limits.deadline_s": -1})
    ... except optuav.InputError as error:
    ...     print(error)
    limits.deadline_s = -1: must be a number, 0 < x <= 1e7 [s]
    limits.min_soc = 2: must be a number, 0 <= x < 1 [-]
    """

    def __init__(self, faults: Iterable[Fault] | str) -> None:
        all_faults = [Fault("", "", faults)] if isinstance(faults, str) else faults
        self.faults = tuple[Fault, ...](all_faults)
        super().__init__(self.faults)

    @for_console
    def __str__(self) -> str:
        lines = [str(fault) for fault in self.faults[:MOST_SHOWN]]
        more = len(self.faults) - len(lines)
        return "\n".join([*lines, f"and {more} more"] if more else lines)


def refuse(faults: Iterable[Fault]) -> None:
    """Raise `InputError` with all faults, if there are any."""
    if found := tuple(faults):
        raise InputError(found)


@contextmanager
def collected(faults: list[Fault]) -> Iterator[None]:
    """Add the faults of an error to others, in place of raising it."""
    try:
        yield
    except InputError as error:
        faults += error.faults


class NoPlanError(OptuavError):
    """A time or state of a plan was requested, but there is no plan.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve(optuav.load("paper").replace({"limits.deadline_s": 20}))
    >>> try:
    ...     plan.hover_time_s
    ... except optuav.NoPlanError as error:
    ...     print(str(error)[:33])
    there is no plan (infeasible): th
    """


class SolverError(OptuavError):
    """An engine failed, or did not prove its answer in the time allowed.

    Examples
    --------
    >>> import optuav
    >>> try:
    ...     optuav.solve("paper", "P3", slot_s=0.01, time_limit_s=1e-9, perspective="battery")
    ... except optuav.SolverError as error:
    ...     print("grid" in str(error))
    True
    """


class MissingExtraError(InputError, ImportError):
    """A package of an extra is missing: both an `InputError` and an `ImportError`.

    Examples
    --------
    >>> from optuav.errors import InputError, require
    >>> try:
    ...     require("nosuch", "such uses")
    ... except ImportError as error:
    ...     print(isinstance(error, InputError), str(error)[:21])
    True such uses need nosuch
    """


def require(package: str, use: str) -> None:
    """Raise `MissingExtraError` where a package is missing that only some uses of optuav need."""
    try:
        import_module(package)
    except ImportError as error:
        extra = EXTRAS.get(package, package)
        command = f'in a clone of optuav: python -m pip install ".[{extra}]"'
        words = f"{use} need {package}, of the extra optuav[{extra}]; {command}"
        raise MissingExtraError(words) from error
    except ValueError as error:  # as matplotlib refuses a setting of the environment
        raise InputError(f"{use} need {package}, which does not start: {error}") from error
