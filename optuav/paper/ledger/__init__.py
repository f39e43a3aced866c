"""The paper's numbers, one by one, beside ours: what matches, what does not, and why."""

from optuav.paper.ledger.entries import Ledger, ledger
from optuav.paper.ledger.statement import Entry, Statement, Verdict

__all__ = ["Entry", "Ledger", "Statement", "Verdict", "ledger"]
