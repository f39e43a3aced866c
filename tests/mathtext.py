"""Pages of LaTeX before a strict reader: matplotlib's mathtext, which knows few commands."""

from __future__ import annotations

import re

from matplotlib.mathtext import MathTextParser


def lines_that_can_be_set(page: str) -> list[str]:
    """The lines of an ``align*``, each of which mathtext takes without alignment marks and tags."""
    first, *lines, last = page.splitlines()
    assert (first, last) == (r"\begin{align*}", r"\end{align*}")
    parser = MathTextParser("path")
    for line in lines:
        untagged = re.sub(r"\\tag\*\{\\\((.*)\\\)\}", r"\\quad \1", line.removesuffix(r" \\"))
        parser.parse("$" + re.sub(r"(?<!\\)&", "", untagged) + "$")
    return lines
