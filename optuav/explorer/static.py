"""The files of the page, and its script as one module without imports."""

from pathlib import Path

FOLDER = Path(__file__).parent / "static"
LIBRARIES = ("d3.min.js", "plot.umd.min.js")  # The second finds the first where it is put
HIDDEN = "define, exports, module, globalThis, self"
"""Names by which a library finds where to put itself; without them it takes `this`."""


def text(name: str) -> str:
    """A file of the page."""
    return (FOLDER / name).read_text("utf-8")


def script() -> str:
    """A module whose default has `render`, with its libraries inside and no global of its own."""
    libraries = "\n".join(text(f"vendor/{name}") for name in LIBRARIES)
    start = f"const {{d3, Plot}} = (function ({HIDDEN}) {{\n"
    return f"{start}{libraries}\nreturn this;\n}}).call({{}});\n{text('explorer.js')}"
