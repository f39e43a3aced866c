"""The status of a programme: one list for engines, plans and their judges."""

from enum import StrEnum

SAME_S = 1e-6  # Times that differ by no more than this are equal, for ties and for proofs [s]


class Status(StrEnum):
    """Status of a programme as stated; one list for all engines."""

    OPTIMAL = "optimal"
    LOCALLY_OPTIMAL = "locally_optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    UNBOUNDED = "unbounded"
    UNKNOWN = "unknown"  # Neither a point nor proof that none exists
    ERROR = "error"  # A number of the programme is NaN, or its answer fails a check

    @property
    def has_answer(self) -> bool:
        """True if values belong to it."""
        return self in (Status.OPTIMAL, Status.LOCALLY_OPTIMAL, Status.FEASIBLE)
