"""Objects that show themselves by their blocks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator

from optuav.errors import folded, line_width, printed
from optuav.presentation.blocks import Block
from optuav.presentation.text import as_lines


class Presented(ABC):
    """Something shown by its blocks: as text when printed, as HTML in a notebook."""

    @abstractmethod
    def blocks(self) -> Iterator[Block]:
        """Yield what is shown: headings, facts, tables and notes."""

    __str__ = printed(lambda self: folded("\n".join(as_lines(self.blocks())), line_width()))

    def _repr_html_(self) -> str:
        from optuav.presentation.html import as_html

        return as_html(self.blocks())
