import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Grid or continuous?
#
# The paper cuts time into slots and tries every pair of them. Continuous times need no search at
# all. How far apart can the two answers be, and what does the grid cost?
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

import optuav

mission = optuav.load("paper")
problem = optuav.P4("b1", order="rest-first")
best = optuav.solve(mission, problem, perspective="battery")
left_s = mission.limits.deadline_s - best.flight_time_s
print(f"continuous: hover {best.hover_time_s:.4f} s, rest {best.rest_time_s:.4f} s")
print(f"time left beside the flight: {left_s:.4f} s")

# %% [markdown]
# ## Slots of many lengths
#
# The engine `grid` tries every pair of whole slots: Algorithm 1 of the paper, whose slot is 1 s.
#
# **Before you run:** how many pairs are there for slots of 1 s, and how many for slots of 0.5 s?
# How much hover do slots of a minute lose at most?

# %%
SLOTS_S = (0.5, 1.0, 5.0, 10.0, 60.0)
print("slot       cells    hover     gap  gap/slot")
for slot_s in SLOTS_S:
    plan = optuav.solve(mission, problem, perspective="battery", slot_s=slot_s)
    slots = math.floor(left_s / slot_s)
    gap_s = best.hover_time_s - plan.hover_time_s
    print(
        f"{slot_s:4.1f} s {slots * (slots - 1) // 2:9} {plan.hover_time_s:7.1f} s {gap_s:5.2f} s"
        f" {gap_s / slot_s:8.2f}"
    )

# %% [markdown]
# ## Why less than one slot
#
# Let h slots fill the time that is left, without remainder. Round the best Δ down to whole slots,
# and rest in all the other slots. The rest is no shorter than before, since h minus a smaller
# number is larger; hovering less and resting more leaves more charge; and it is a cell of the grid.
# So the grid's best is at least the best Δ rounded down.
#
# The argument fails where resting discharges, and where part of a slot is left over at the end.
# That part is lost for resting; if rounding shortens Δ by little, a whole slot more has to be given
# up. With that slot the rest is longer than before in any case, so less than two slots are lost.
#
# **Before you run:** of the deadlines below, which can lose more than one slot?

# %%
SLOT_S = 50.0
lost = {}
for slots in (28.0, 28.3, 28.6, 28.9, 29.0):
    deadline_s = best.flight_time_s + slots * SLOT_S
    changed = mission.replace({"limits.deadline_s": deadline_s})
    exact, cut = (
        optuav.solve(changed, problem, perspective="battery", slot_s=slot_s)
        for slot_s in (None, SLOT_S)
    )
    lost[slots] = (exact.hover_time_s - cut.hover_time_s) / SLOT_S
    print(f"time for {slots:.1f} slots: {lost[slots]:.3f} slots of hover lost")

# %% [markdown]
# The plane shows it for slots of 100 s: the best dot lies below the corner of the two lines.

# %%
program = optuav.formulate(mission, problem, perspective="battery")
(part,) = program.parts
cut = optuav.solve(mission, problem, perspective="battery", slot_s=100.0)
optuav.plots.plane(part.model, part.model.row(0), [best, cut], slot_s=100.0)

# %% [markdown]
# ## The paper's 740.65 s
#
# Table II of the paper has a hover of 740.65 s, in slots of a second. Without a rest, a hover that
# the deadline cuts short keeps its last, begun slot, if the battery can afford all of it. So Δ is
# no whole number there, and slots lose nothing.

# %%
table2 = optuav.load("paper-table2").replace({"limits.deadline_s": 800})
by_slots, exact = (
    optuav.solve(table2, "P3", slot_s=slot_s, perspective="battery") for slot_s in (1.0, None)
)
print(f"slots {by_slots.hover_time_s:.2f} s, continuous {exact.hover_time_s:.2f} s")

# %% [markdown]
# ## Branch and bound instead of all cells
#
# Counting slots means whole numbers. `cvxpy` passes the problem to a mixed-integer solver: it first
# solves the problem with continuous times, its *relaxation*, whose optimum is a bound, and then
# searches only where a cell could still be better. It finds the same Δ without visiting every cell;
# [Discrete, relaxed, continuous](12_discrete_relaxed_continuous.py) follows it on its way.

# %%
for slot_s in (10.0, 60.0):
    cells, tree = (
        optuav.solve(mission, problem, perspective="battery", slot_s=slot_s, engine=engine)
        for engine in ("grid", "cvxpy")
    )
    for plan in (cells, tree):
        print(f"slots of {slot_s:g} s: {plan.hover_time_s:g} s of hover, {plan.proof}")

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
