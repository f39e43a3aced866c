"""Objects that show themselves by their blocks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator

from optuav.presentation.blocks import Block
from optuav.presentation.text import as_text


class Presented(ABC):
    """Something shown by its blocks: as text when printed, as HTML in a notebook."""

    @abstractmethod
    def blocks(self) -> Iterator[Block]:
        """Yield what is shown: headings, facts, tables, notes and pictures."""

    def __str__(self) -> str:
        return as_text(self.blocks())

    def _repr_html_(self) -> str:
        from optuav.presentation.html import as_html

        return as_html(self.blocks())
