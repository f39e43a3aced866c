"""The files of the page, and its script as one module without imports; its words are a table."""

import json
import re
from pathlib import Path

from optuav.looks import LOOKS, variables

FOLDER = Path(__file__).parent / "static"
LIBRARIES = ("d3.min.js", "plot.umd.min.js")  # The second finds the first where it is put
MODULES = (
    *("state", "drawing", "map", "plane", "pictures", "wells"),
    *("controls", "saying", "layout", "saving", "explorer"),
)
HIDDEN = "define, exports, module, globalThis, self"
"""Names that tell a library where to put itself; without them it takes `this`."""
BETWEEN = re.compile(r"^import [^;]*;\n|^export (?=const|function|class)", re.MULTILINE)


def text(name: str) -> str:
    """A file of the page."""
    return (FOLDER / name).read_text("utf-8")


def style() -> str:
    """The style with the table of colours above it."""
    return variables(".optuav-page, .optuav-frame") + text("explorer.css")


def script() -> str:
    """A module whose default has `render`, with its libraries inside and no global of its own."""
    libraries = "\n".join(text(f"vendor/{name}") for name in LIBRARIES)
    start = f"const {{d3, Plot}} = (function ({HIDDEN}) {{\n"
    looks = f"const LOOKS = {json.dumps({role: look._asdict() for role, look in LOOKS.items()})};"
    looks += f"\nconst WORDS = {text('words.json')}, PAGE = {json.dumps(text('explorer.html'))};"
    modules = BETWEEN.sub("", "\n".join(text(f"{name}.js") for name in MODULES))
    return f"{start}{libraries}\nreturn this;\n}}).call({{}});\n{looks}\n{modules}"
