"""The paper's tables and figures, made anew for any mission, with a report."""

from optuav.paper.reproduce.run import NAMES, STUDIES, reproduce

__all__ = ["NAMES", "STUDIES", "reproduce"]
