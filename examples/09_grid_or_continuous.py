# %% [markdown]
# # Grid or continuous?
#
# The paper cuts time into slots and tries every pair of them. Continuous times need no search at
# all. How far apart can the two answers be, and how much work does the grid take?
#
# **Before this lesson:** [(P4): the plane and shadow prices](07_p4_plane_and_shadow_prices.py).
# **Time:** 35 minutes.
#
# **Learning intentions.** After this page you can
#
# - prove that slots lose less than one slot of hover if whole slots fill the time that is left, and
#   less than two in any case;
# - predict the number of cells that a grid visits;
# - choose between a grid, a mixed-integer programme and continuous times.

# %%
import math

import pandas as pd

import optuav

pd.set_option("display.max_colwidth", None)  # Proofs in full
mission = optuav.load("paper")
problem = optuav.P4("b1", order="rest-first")
best = optuav.solve(mission, problem, perspective="battery")
left_s = mission.limits.deadline_s - best.flight_time_s
{"hover [s]": best.hover_time_s, "rest [s]": best.rest_time_s, "left beside flight [s]": left_s}

# %% [markdown]
# ## Slots of many lengths
#
# The engine `grid` tries every pair of whole slots: Algorithm 1 of the paper, whose slot is 1 s.
#
# **Before you run:** how many pairs are there for slots of 1 s, and how many for slots of 0.5 s?
# How much hover do slots of a minute lose at most?

# %%
SLOTS_S = [0.5, 1.0, 5.0, 10.0, 60.0]
by_slot = pd.DataFrame({"slot [s]": SLOTS_S})
by_slot["cells"] = [math.comb(math.floor(left_s / slot_s), 2) for slot_s in SLOTS_S]
by_slot["hover [s]"] = [
    optuav.solve(mission, problem, perspective="battery", slot_s=slot_s).hover_time_s
    for slot_s in SLOTS_S
]
by_slot["lost [s]"] = best.hover_time_s - by_slot["hover [s]"]
by_slot["lost [slots]"] = by_slot["lost [s]"] / by_slot["slot [s]"]
by_slot.round(2)

# %% [markdown]
# ## Why less than one slot
#
# Let h slots fill the time that is left, without remainder. Round the best Δ down to whole slots,
# and rest in all the other slots. The rest is no shorter than before, since h minus a smaller
# number is larger. Hovering less and resting more leaves more charge. So this plan is a cell of the
# grid, and the grid's best is at least the best Δ rounded down.
#
# The argument fails if resting discharges, or if part of a slot is left over at the end. That part
# is lost for resting. If rounding shortens Δ by only a little, the plan has to give up a whole slot
# more. With that slot the rest is longer than before in any case, so it loses less than two slots.
#
# **Before you run:** of the deadlines below, which can lose more than one slot?

# %%
SLOT_S = 50.0


def lost(slots):
    """Return the hover that slots lose [slots], with time for so many beside the flight."""
    changed = mission.replace({"limits.deadline_s": best.flight_time_s + slots * SLOT_S})
    exact, cut = (
        optuav.solve(changed, problem, perspective="battery", slot_s=slot_s)
        for slot_s in (None, SLOT_S)
    )
    return (exact.hover_time_s - cut.hover_time_s) / SLOT_S


by_deadline = {slots: lost(slots) for slots in (28.0, 28.3, 28.6, 28.9, 29.0)}
pd.Series(by_deadline, name="lost [slots]").rename_axis("time for slots").to_frame().round(3)

# %% [markdown]
# The plane shows the reason for slots of 100 s: the best dot lies below the corner of the two
# lines.

# %%
program = optuav.formulate(mission, problem, perspective="battery")
(part,) = program.parts
cut = optuav.solve(mission, problem, perspective="battery", slot_s=100.0)
optuav.plots.plane(part.model, part.model.row(0), [best, cut], slot_s=100.0)

# %% [markdown]
# ## The paper's 740.65 s
#
# Table II of the paper has a hover of 740.65 s, in slots of a second. Without a rest, a hover that
# the deadline cuts short keeps its last, begun slot, if the battery can afford all of it. So Δ need
# not be a whole number, and slots lose nothing.
#
# **Before you run:** how long is the hover in continuous times?

# %%
table2 = optuav.load("paper-table2").replace({"limits.deadline_s": 800})
by_slots, exact = (
    optuav.solve(table2, "P3", slot_s=slot_s, perspective="battery") for slot_s in (1.0, None)
)
by_slots.hover_time_s, exact.hover_time_s

# %% [markdown]
# ## Branch and bound instead of all cells
#
# Counting slots means whole numbers. `cvxpy` passes the problem to a mixed-integer solver. That
# solver first solves the problem with continuous times, its *relaxation*, whose optimum is a bound.
# Then it searches only where a cell could still be better. It finds the same Δ without visiting
# every cell; [Discrete, relaxed, continuous](12_discrete_relaxed_continuous.py) shows the steps.

# %%
plans = [
    optuav.solve(mission, problem, perspective="battery", slot_s=slot_s, engine=engine)
    for slot_s in (10.0, 60.0)
    for engine in ("grid", "cvxpy")
]
pd.DataFrame(
    [(plan.slot_s, plan.engine, plan.hover_time_s, plan.proof) for plan in plans],
    columns=["slot [s]", "engine", "hover [s]", "proof"],
)

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("09.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# With slots a little longer than a whole part of the hover, nearly one of them is left over.
direct_s = optuav.solve(task.mission, "P3").hover_time_s
parts = int(direct_s // task["coarse_s"]) + 1
letter = next(key for key, reason in task.reasons.items() if "divides the other" in reason)
answer_1 = letter, direct_s / parts + 1e-4
### END SOLUTION

# %%
grade = exercises.check("09.1", answer_1, student)
print(grade)
