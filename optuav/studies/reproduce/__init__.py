"""The paper's tables and figures, made anew for any mission, with a report."""

from optuav.studies.reproduce.run import NAMES, STUDIES, reproduce

__all__ = ["NAMES", "STUDIES", "reproduce"]
