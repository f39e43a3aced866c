"""A plan as a pandas table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from optuav.plan.plan import Plan

if TYPE_CHECKING:
    import pandas

COLUMNS = (
    "kind",
    "start_place",
    "end_place",
    "start_s",
    "duration_s",
    "current_A",
    "power_W",
    "distance_m",
    "peak_speed_m_s",
    "edited",
)


def to_frame(plan: Plan) -> pandas.DataFrame:
    """One row a phase, in order.

    Parameters
    ----------
    plan
        A plan; where there is none, the table has no rows.

    Returns
    -------
    Columns as the attributes of `Phase`, mean current [A] and power [W] into the battery, and the
    charge in the wells at its end, ``available_As`` and ``bound_As``, summed over the packs [A s].

    Raises
    ------
    ModuleNotFoundError
        If pandas is not installed.
    """
    import pandas

    rows = [
        {
            **{column: getattr(phase, column) for column in COLUMNS},
            "available_As": sum(phase.available_As),
            "bound_As": sum(phase.bound_As),
        }
        for phase in plan.phases
    ]
    return pandas.DataFrame(rows, columns=[*COLUMNS, "available_As", "bound_As"])
