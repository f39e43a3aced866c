"""``optuav lessons``: the lessons of the course as notebooks or scripts, with their data."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import optuav
from optuav.cli.output import say
from optuav.errors import Fault, InputError, collected, refuse

LESSONS = Path(optuav.__file__).parent / "lessons"
"""The notebooks, and the folder of data that they read."""

SHOWN = re.compile(r"^(task|grade)$", re.MULTILINE)  # In notebooks; a script must print it


def lessons(directory: Path, scripts: bool = False) -> None:
    """Copy the lessons and their data into a directory."""
    from optuav.mission.files import make_directory, must_be_new, write_files

    files, faults = _files(directory, scripts=scripts), list[Fault]()
    for path in files:
        with collected(faults):
            must_be_new(path)
    refuse(faults)
    data = directory / "data"
    folders = directory, *directory.parents, data
    made, new = ([path for path in some if not path.exists()] for some in (folders, files))
    make_directory(directory)
    make_directory(data)
    try:
        write_files(files)
    except InputError:
        for path in new:
            path.unlink(missing_ok=True)
        for path in sorted(made, key=lambda each: -len(each.parts)):
            if path.is_dir():
                path.rmdir()
        raise
    kind = "scripts" if scripts else "notebooks"
    number, first = len([*LESSONS.glob("*.ipynb")]), min(files).name
    start = f"python {first}" if scripts else f"jupyter lab {first}"
    said = f"wrote {number} {kind} and their data into {directory}"
    say(f"{said}; next: cd {directory}; {start}", most=None)


def _files(directory: Path, *, scripts: bool) -> dict[Path, bytes]:
    """Files to write, by place."""
    files = {}
    for path in sorted(LESSONS.glob("*.ipynb")):
        text = path.read_text("utf-8")
        name = path.with_suffix(".py").name if scripts else path.name
        files[directory / name] = (_script(json.loads(text)) if scripts else text).encode()
    for path in sorted(LESSONS.glob("data/*.*")):
        files[directory / path.relative_to(LESSONS)] = path.read_bytes()
    return files


def _script(notebook: dict[str, Any]) -> str:
    """A notebook as a script in cells."""
    parts = []
    for cell in notebook["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            source = source.replace(".ipynb)", ".py)")  # Links from one lesson to another
            lines = (f"# {line}".rstrip() for line in source.split("\n"))
            parts.append("\n".join(["# %% [markdown]", *lines]))
        else:
            source = SHOWN.sub(r"print(\1)", source)
            parts.append(f"# %%\n{source}")
    return "\n\n".join(parts) + "\n"
