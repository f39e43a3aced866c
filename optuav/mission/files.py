"""Reads TOML, JSON and CSV files, and writes every file that the package makes."""

import contextlib
import errno
import io
import json
import os
import re
import stat
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import Any, BinaryIO

from optuav.errors import LONGEST_NAME, Fault, InputError, printable, safe_name
from optuav.mission.formats import named
from optuav.presentation.numbers import figure

LARGEST_TOML = 2_000_000  # bytes
MOST_PARTS = 8  # In a dotted key: the time and memory of tomllib grow with the square of the parts
MOST_KEYS = 10_000  # Keys of one table
MOST_VALUES, MOST_LEVELS = 2_000_000, 64  # Values and nesting of one JSON file
MOST_LINES, LONGEST_LINE = 700_000, 10_000  # Lines of one CSV file, and bytes of a line

_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"?|'[^'\n]*+'?)[ \t]*+"""
_SHALLOW = re.compile(
    rf"""(?:
        \"\"\"(?:[^"\\]|\\.|"(?!""))*+(?:"{{3,5}})?  # strings of several lines
        | '''(?:[^']|'(?!''))*+(?:'{{3,5}})?
        | \#[^\n]*+
        | (?!(?:{_PART}\.[ \t]*+){{{MOST_PARTS}}}){_PART}
        | [^\w"'\#-]
    )*+""",
    re.ASCII | re.DOTALL | re.VERBOSE,
)
"""All of a TOML file up to a key of more than `MOST_PARTS` parts; in linear time."""

STANDARD = Path("-")
"""Stands for the standard input where it is read, and for the standard output where written."""
TEMPORARY = ".optuav.tmp"
"""Name of a file in the making; one per folder, as writers of one folder wait for one another."""
LONGEST_WAIT_S, A_MOMENT_S = 10.0, 0.01
NOT_OFFERED = (errno.EINVAL, errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
NO_LINKS = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)  # Flags of POSIX
MARK, HEAD, LEAST_START = b"optuav", 4096, 20
"""Mark in the first bytes of our files; or else in their first line, if it is so long."""
PARQUET = b"PAR1"
XML = b"<?xml"  # Of a first line that all files of a kind have
PDF, PDF_END = b"%PDF", 16_384
"""Beginning of a PDF, and bytes at its end that hold its creator and the table of its objects."""

PLACED = re.compile(r"(.*) \(at (line \d+, column \d+|end of document)\)", re.DOTALL)
SYNTAX = {
    "Cannot (overwrite|declare|mutate|redefine)|Duplicate": "a key or a table appears twice",
    "Expecting value|Invalid (value|statement|initial)": "this is neither a key nor a value",
    "Expecting property name": "a name in double quotes is missing",
    "Expecting ':'": "a colon is missing",
    "Expecting ','": "a comma or a closing bracket is missing",
    "Illegal trailing comma": "a closing bracket follows a comma",
    "Extra data": "the value has ended; delete the rest",
    "Expected '='": "an equals sign is missing",
    "Expected newline|Expected end": "a new line is missing after the value",
    "Expected '\\]|Unclosed": "a bracket is not closed",
    "Unterminated|Expected [\"']": "a text has no closing quote",
    "Illegal character|Found invalid character|Invalid control": "a text has a control character",
    ".*(escape|Escape|backslash|Unescaped|hex value)": "a backslash begins no known escape",
    "Invalid date": "this is not a date",
}
"""Words for what Python's parsers of TOML and JSON say, by a pattern of how that begins."""

unfinished: set[Path] = set()  # Files that a signal handler which ends the process has to delete
keep_foreign_files: ContextVar[bool] = ContextVar("keep_foreign_files", default=False)
"""True if only files that optuav has written may be replaced."""


def label(path: Path) -> str:
    """The path as a fault shows it."""
    return "standard input" if path == STANDARD else printable(str(path))


def refusal(path: Path, words: str) -> InputError:
    """Return the fault of a file as a whole."""
    return InputError([Fault("", "", words, label(path))])


def read_text(path: Path, limit: int, *, hint: str = "", own: bool = False) -> str:
    """The text of a regular file in UTF-8, with or without a byte-order mark, up to `limit` bytes.

    The hint is added if the file does not exist; ``-`` is the standard input. See `opened`.
    """
    with refusals(path, "read"):
        if path == STANDARD:
            content = sys.stdin.buffer.read(limit + 1) if sys.stdin else b""
        else:
            with opened(path, limit, hint=hint, own=own) as file:
                content = file.read(limit + 1)
    if len(content) > limit:
        raise _too_large(path, limit)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        words = f"is not text in UTF-8: byte 0x{error.object[error.start]:02x} at {error.start}"
        if what := named(content):
            words = f"is not text in UTF-8 but {what.words}"
        raise refusal(path, words) from None


@contextlib.contextmanager
def opened(path: Path, limit: int, *, hint: str = "", own: bool = False) -> Iterator[BinaryIO]:
    """A regular file of at most `limit` bytes, open for reading; an own file is never a link.

    Own files lie in a directory that only optuav writes to.
    """
    with refusals(path, "read"):
        try:
            _must_be_regular(path, path.lstat() if own else path.stat())
        except FileNotFoundError:
            raise refusal(path, f"there is no such file{hint}") from None
        flags = os.O_RDONLY | (NO_LINKS if own else 0) | getattr(os, "O_BINARY", 0)
        with open(os.open(path, flags), "rb") as file:
            status = os.fstat(file.fileno())
            _must_be_regular(path, status)  # Another may stand there by now
            if status.st_size > limit:
                raise _too_large(path, limit)
            yield file


def must_be_file(path: Path) -> None:
    """Refuse what is no file, for libraries that open it by its path."""
    if not path.is_file():
        raise refusal(path, "is no regular file" if path.exists() else "there is no such file")


def _must_be_regular(path: Path, status: os.stat_result) -> None:
    """Refuse directories, devices, pipes, and links that are not followed."""
    kind = status.st_mode
    what = "a link, not a regular file" if stat.S_ISLNK(kind) else "no regular file"
    if not stat.S_ISREG(kind):
        raise refusal(path, f"is {'a directory, not a file' if stat.S_ISDIR(kind) else what}")


def _too_large(path: Path, limit: int) -> InputError:
    return refusal(path, f"is larger than the {figure(limit / 1e6)} MB that are read")


def write_own(path: Path, content: bytes) -> None:
    """Write an own file whole or not at all, and never through a link."""
    with refusals(path, "written"):
        if os.path.lexists(path):
            _must_be_regular(path, path.lstat())
        _replace(path, None, content)


def read_toml(path: Path, *, hint: str = "") -> dict[str, Any]:
    """The tables of a TOML file, see `read_text` and `parse_toml`."""
    return parse_toml(read_text(path, LARGEST_TOML, hint=hint), label(path))


def parse_toml(text: str, source: str = "") -> dict[str, Any]:
    """The tables of a TOML text; refused if they are nested too deeply or have too many keys."""
    words = f"has a dotted name of more than {MOST_PARTS} parts"
    if len(text) > LARGEST_TOML:
        words = f"is larger than the {figure(LARGEST_TOML / 1e6)} MB that are read"
    elif _SHALLOW.fullmatch(text):
        try:
            document = tomllib.loads(text)
        except RecursionError:
            words = "is nested too deeply"
        except ValueError as error:
            words = f"is not TOML: {_error_words(error)}"
            if '"kind": "optuav plan"' in text[:1000]:
                words = "is a saved plan: use optuav show or optuav audit"
            elif what := named(text.encode()):
                words = f"is {what.words}"
        else:
            tables = [table for table in document.values() if isinstance(table, dict)]
            if max(map(len, [document, *tables])) <= MOST_KEYS:
                return document
            words = f"has a table of more than {MOST_KEYS} keys"
    raise InputError([Fault("", "", words, source)])


def parse_json(text: str, source: str, most: int = MOST_VALUES) -> Any:
    """The value that a JSON text holds; refused if it is nested too deeply or has too many."""
    words = f"has more than {most} values"
    if sum(map(text.count, ",[{")) <= most:
        words = f"is not JSON: it is nested in more than {MOST_LEVELS} levels"
        try:
            document = json.loads(text, parse_constant=_no_constant, object_pairs_hook=_object)
            if "\\u" in text:
                json.dumps(document, ensure_ascii=False).encode()  # As other files will hold it
            if not _is_deep(document):
                return document
        except RecursionError:
            pass
        except UnicodeEncodeError:
            words = "is not JSON: it has one half of a surrogate pair, which is not a letter"
        except ValueError as error:
            words = f"is not JSON: {_error_words(error)}"
            if re.search(r"^schema *= *\d", text, re.MULTILINE):
                words = "is a mission, not a saved plan: use optuav solve or validate"
                if re.search(r"^(\[\[ *)?stops\b", text, re.MULTILINE):
                    words = "is an itinerary, not a saved plan: use optuav audit"
            elif text[:1] not in ("{", "[") and (what := named(text.encode())):
                words = f"is {what.words}"
    raise InputError([Fault("", "", words, source)])


def _is_deep(value: Any) -> bool:
    """Return whether lists and objects are nested in more than `MOST_LEVELS` levels."""
    level = [value]
    for _ in range(MOST_LEVELS):
        nested = (value for value in level if isinstance(value, dict | list))
        level = [
            x for value in nested for x in (value.values() if isinstance(value, dict) else value)
        ]
    return any(isinstance(value, dict | list) for value in level)


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is not a JSON number")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the object of keys and values; a repeated key is refused, as one would be lost."""
    content = dict(pairs)
    if len(content) < len(pairs):
        ((key, _),) = Counter(key for key, _ in pairs).most_common(1)
        raise ValueError(f"an object contains the key {safe_name(key)!r} more than once")
    return content


def ends_early(text: str) -> bool:
    """Return whether a JSON text ends within a value."""
    try:
        json.loads(text)
    except json.JSONDecodeError as error:
        return _is_at_end(error)
    except (ValueError, RecursionError):
        return False
    return False


def _is_at_end(error: json.JSONDecodeError) -> bool:
    """Return whether the parser came to the end of a text, and needed more of it."""
    return error.pos >= len(error.doc.rstrip()) or error.msg.startswith("Unterminated string")


def _error_words(error: ValueError) -> str:
    """Return the fault of a text and its place, with our words in place of the parser's."""
    if "set_int_max_str_digits" in str(error):
        return f"a whole number has more than {sys.get_int_max_str_digits()} digits"
    if isinstance(error, json.JSONDecodeError):
        said, where = error.msg, f"line {error.lineno}, column {error.colno}"
        if not error.doc.strip():
            return "it is empty"
        if error.pos >= len(error.doc.rstrip()):
            return f"{where}: it ends within a value, as if it were cut off"
    elif placed := PLACED.fullmatch(str(error)):
        said, where = placed[1], placed[2].replace("end of document", "its end")
    else:
        return str(error)
    words = next((words for form, words in SYNTAX.items() if re.match(form, said)), "is wrong")
    return f"{where}: {words}"


def csv_rows(text: str, source: str, mark: str = ",") -> Iterator[tuple[int, list[str]]]:
    """The lines of a CSV text by number, without those that are blank or begin with ``#``.

    A mark stands between the cells.
    """
    import csv

    for number, line in enumerate(io.StringIO(text, newline=None), start=1):
        if number > MOST_LINES:
            raise InputError([Fault("", "", f"has more than {MOST_LINES} lines", source)])
        if len(line) > LONGEST_LINE:
            words = f"has more than {LONGEST_LINE} characters"
            raise InputError([Fault("", "", words, f"{source}, line {number}")])
        if line.strip(f" {mark}\t\n") and not line.startswith("#"):
            cells = next(csv.reader([line.rstrip("\n")], delimiter=mark))
            yield number, [cell.strip() for cell in cells]


def check_place(path: Path, content: bytes | None = None) -> None:
    """Refuse a place that no file can be written to, or not this content, where it is known."""
    with refusals(path, "written"):
        if path == STANDARD:
            return
        target = Path(os.path.realpath(path))
        if path.is_dir():
            raise refusal(path, "is a directory, not a file")
        if not (taken := path.exists()) and not target.parent.is_dir():
            folder = target.parent if path.parent.is_dir() else path.parent
            raise refusal(path, f"there is no directory {label(folder)}")
        changed = [path] * taken + [target.parent] * (path.is_file() or not taken)
        if not all(os.access(place, os.W_OK) for place in changed):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        if not keep_foreign_files.get() or not path.is_file() or not path.stat().st_size:
            return
        if content is None and path.suffix == ".csv":
            return  # only its header can tell
        # A text of waypoints has no place for a mark, but its notes beside it
        notes = path.with_suffix(".txt")
        marked = notes if path.suffix.lower() == ".waypoints" and notes.is_file() else path
        with marked.open("rb") as file:
            head = file.read(HEAD)
            if head.startswith(PARQUET):  # Its metadata, and their length, are at its end
                end = max(0, path.stat().st_size - 8)
                file.seek(end)
                file.seek(max(0, end - int.from_bytes(file.read(4), "little")))
                head += file.read()
            elif head.startswith(PDF):  # Its creator is near its end
                file.seek(max(0, path.stat().st_size - PDF_END))
                head += file.read()
    start = (content or b"").partition(b"\n")[0]
    telling = len(start) >= LEAST_START and not start.startswith(XML)
    if MARK not in head and not (telling and head.startswith(start)):
        words = "is not from optuav and stays; name another file, or give --force to replace it"
        raise refusal(path, words)


def _quoted(path: Path) -> str:
    """A path in quotes: the end of a very long one, where its suffix is."""
    text = printable(str(path))
    return repr(text if len(text) <= LONGEST_NAME else f"...{text[3 - LONGEST_NAME :]}")


def ending_of(path: Path, *endings: str, name: str = "path") -> str:
    """Return the suffix of a file, which decides its format; refused unless it is one of `endings`.

    An empty ending allows names without a suffix, such as device names.
    """
    suffix = path.suffix.lower()
    if suffix not in endings:
        *others, last = filter(None, endings)
        words = f"a name that ends in {' or '.join(filter(None, [', '.join(others), last]))}"
        raise InputError([Fault(name, _quoted(path), words)])
    return suffix


def expand_home(stated: str | Path, name: str = "path") -> Path:
    """A path whose ``~`` is the home of the user; refused if no such user is known."""
    path = Path(stated)
    try:
        return path.expanduser()
    except RuntimeError:
        words = f"there is no user {path.parts[0][1:]!r}; give the whole path"
    except ValueError:
        words = "is not a possible path"
    raise InputError([Fault(name, _quoted(path), words)])


def resolve_from(folder: Path, stated: str | Path, name: str = "path") -> Path:
    """A path that is stated relative to a folder, see `expand_home`."""
    return folder / expand_home(stated, name)


def relative_to(file: Path, path: str) -> str:
    """A path from the folder of a file; the whole path where no other leads there."""
    with contextlib.suppress(ValueError):
        path = os.path.relpath(path, os.path.dirname(os.path.abspath(file)))
    return Path(path).as_posix()


def must_be_new(path: Path) -> None:
    """Refuse a name that is taken, for a file that people go on to edit."""
    with refusals(path, "written"):
        if keep_foreign_files.get() and path != STANDARD and path.exists():
            raise refusal(path, "exists already; name a new file, or give --force to replace it")


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, see `write_files`."""
    write_files({path: text.encode("utf-8")})


def write_files(files: Mapping[Path, bytes]) -> None:
    """Write each file whole or not at all; none if one has no place.

    A regular file is replaced and keeps its mode, its owner and all links to it; any other is
    written to, and ``-`` is the standard output.
    """
    for path, content in files.items():
        check_place(path, content)
    for path, content in files.items():
        place = Path("standard output") if path == STANDARD else path
        with refusals(place, "written"):
            try:
                old = None if path == STANDARD else path.stat()
            except FileNotFoundError:
                old = None
            if path == STANDARD or (old and _is_output(old)):
                sys.stdout.flush()
                sys.stdout.buffer.write(content)
                sys.stdout.flush()
            elif old and not stat.S_ISREG(old.st_mode):
                with path.open("wb", buffering=0) as device:
                    _put(device.fileno(), content)
            else:
                _replace(Path(os.path.realpath(path)), old, content)


def _is_output(status: os.stat_result) -> bool:
    """Return whether a regular file receives the standard output, which others write to as well."""
    with contextlib.suppress(OSError):
        return stat.S_ISREG(status.st_mode) and os.path.samestat(status, os.fstat(1))
    return False


def _replace(target: Path, old: os.stat_result | None, content: bytes) -> None:
    """Put a new file in the place of an old one, or of none."""
    temporary = target.with_name(TEMPORARY)
    with _locked(target.parent) as folder:
        unfinished.add(temporary)
        try:
            temporary.unlink(missing_ok=True)  # left by a killed process
            flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
            number = os.open(temporary, flags, 0o666)
            try:
                kept = old is None or _alike(number, old)
                _put(number, content)
                os.fsync(number)
            finally:
                os.close(number)
            if folder is not None:
                _where_offered(os.fsync, folder)
            if kept:
                os.replace(temporary, target)
            else:
                _overwrite(target, content)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            unfinished.discard(temporary)


def _alike(number: int, old: os.stat_result) -> bool:
    """Give a new file the owner and the mode of the old; False where it cannot take its place."""
    if sys.platform == "win32":
        return True
    new = os.fstat(number)
    try:
        if (new.st_uid, new.st_gid) != (old.st_uid, old.st_gid):
            os.fchown(number, old.st_uid, old.st_gid)
    except PermissionError:
        return False
    os.fchmod(number, stat.S_IMODE(old.st_mode))
    return old.st_nlink == 1


def _overwrite(target: Path, content: bytes) -> None:
    """Change a file that has other names or another owner; if that fails, it keeps its content."""
    with target.open("r+b", buffering=0) as file:
        before = file.read()
        try:
            _put(file.fileno(), content, anew=True)
        except OSError:
            _put(file.fileno(), before, anew=True)
            raise


def _put(number: int, content: bytes, *, anew: bool = False) -> None:
    """Write all bytes, from the start of a file that then ends there, or where it stands."""
    if anew:
        os.lseek(number, 0, os.SEEK_SET)
    left = memoryview(content)
    while left:
        left = left[os.write(number, left) :]
    if anew:
        os.ftruncate(number, len(content))
        os.fsync(number)


def _where_offered(call: Callable[..., object], *given: object) -> None:
    """Call the system for what some file systems do not offer, and others do well without."""
    try:
        call(*given)
    except OSError as error:
        if error.errno not in NOT_OFFERED:
            raise


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[int | None]:
    """Lock a folder against other writers, and yield its descriptor; None on Windows."""
    if sys.platform == "win32":
        yield None
        return
    import fcntl

    number, latest_s = os.open(folder, os.O_RDONLY), time.monotonic() + LONGEST_WAIT_S
    try:
        while True:
            try:
                _where_offered(fcntl.flock, number, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() > latest_s:
                    raise
                time.sleep(A_MOMENT_S)
        yield number
    finally:
        os.close(number)


def make_directory(path: Path) -> None:
    """Make a directory if it does not exist."""
    with refusals(path, "made"):
        path.mkdir(parents=True, exist_ok=True)


@contextlib.contextmanager
def refusals(path: Path, done: str) -> Iterator[None]:
    """Turn the system's errors into an `InputError`."""
    try:
        yield
    except InputError:
        raise
    except FileExistsError:
        raise refusal(path, "is not a directory") from None
    except OSError as error:
        raise refusal(path, f"cannot be {done}: {error.strerror}") from None
    except ValueError:
        raise refusal(path, "is not a possible path") from None
