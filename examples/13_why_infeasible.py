# %% [markdown]
# # Why infeasible?
#
# "Infeasible" alone is a correct answer of little help. Which constraints conflict, how can I check
# that they do, and what should I change? (Change the numbers of the mission as you like. If nothing
# conflicts, there is no certificate, and the tables below are empty.)
#
# **Before this lesson:** [(P4): the plane and shadow prices](07_p4_plane_and_shadow_prices.py),
# [Duality and KKT](08_duality_and_kkt.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - read a certificate of infeasibility, and check it with pencil and paper;
# - distinguish constraints that conflict from those that are only violated somewhere;
# - choose among the smallest changes that repair a mission, and verify one.

# %%
from fractions import Fraction

import numpy as np
import pandas as pd

import optuav

mission = optuav.load("paper-table2").replace(
    {"battery.capacity_As": 2900, "limits.deadline_s": 200}  # a lighter drone in a hurry
)
problem = optuav.P4("b1", order="rest-first")
plan = optuav.solve(mission, problem, perspective="battery")
plan

# %% [markdown]
# A plan that does not exist has no times; asking for one raises an error with the reason:

# %%
try:
    answer = plan.hover_time_s
except optuav.NoPlanError as error:
    answer = error
answer

# %% [markdown]
# ## No single constraint is the reason
#
# Without a rest there is too little charge. With enough rest the drone misses the deadline. A plan
# can satisfy each constraint, but not both together, and trying points can never prove that.
#
# **Before you run:** at which of the four rests below is the charge enough?

# %%
program = optuav.formulate(mission, problem, perspective="battery")
rests_s = np.array([0.0, 60.0, 120.0, 180.0])
rows = program.check({"hover_time_s": 0.0, "rest_time_s": rests_s})
slacks = pd.DataFrame(
    {row.label: np.broadcast_to(row.slack, rests_s.shape) for row in rows},
    index=pd.Index(rests_s, name="rest [s]"),
)
slacks.round(3)

# %% [markdown]
# A negative slack is a violation. Only the last rest gives enough charge, and there the deadline is
# missed.
#
# Each constraint leaves a longest hover for every rest. When the longest hover of the charge is
# above zero at last, the longest hover of the deadline is below zero already:

# %%
rests_s = np.linspace(120.0, 150.0, 61)


def slack(label, hover_s):
    """Return the slack of a constraint over the rests."""
    rows = program.check({"hover_time_s": hover_s + 0.0 * rests_s, "rest_time_s": rests_s})
    return next(row.slack for row in rows if row.label == label)


lines = [optuav.plots.Line("least hover", rests_s, 0.0 * rests_s)]
for label in ("P4.a state of charge", "P4.b deadline"):
    without, one_second = slack(label, 0.0), slack(label, 1.0)  # linear: seconds cost alike
    lines.append(optuav.plots.Line(label, rests_s, without / (without - one_second)))
optuav.plots.curves(
    lines,
    title="The longest hover that each constraint leaves",
    x_label="rest time T' [s]",
    y_label="hover time Δ [s]",
)

# %% [markdown]
# ## The certificate
#
# Farkas' lemma: linear constraints conflict exactly if some combination of them, each multiplied by
# a number ≥ 0, adds up to something false. `explain` finds the numbers, and uses only constraints
# that are needed.

# %%
explanation = optuav.explain(program)
explanation

# %% [markdown]
# Check it. The rows read Σ coefficient · unknown ≤ limit, with exact fractions, so that there is no
# rounding error.
#
# **Before you run:** what must the coefficients of the sum be, and what its limit, so that no point
# at all can satisfy it?

# %%
certificates = [proof for conflict in explanation.conflicts for proof in conflict.certificates]
rows = [row for certificate in certificates for row in certificate.rows]
total = {
    symbol: sum((row.multiplier * row.coefficients.get(symbol, 0) for row in rows), Fraction(0))
    for symbol in ("Δ", "T'")
}
limit = sum((row.multiplier * row.limit for row in rows), Fraction(0))
total, float(limit), [certificate.holds() for certificate in certificates]

# %% [markdown]
# The sum reads 0 ≤ a negative number, which is false at every point.
#
# The rows are those of the statement: at any point, the limit less the left side is the slack that
# `check` finds.

# %%
point = {"Δ": Fraction(10), "T'": Fraction(20)}
slack_by_label = {
    row.label: row.slack for row in program.check({"hover_time_s": 10.0, "rest_time_s": 20.0})
}
pd.DataFrame(
    [
        (
            row.label,
            float(row.limit - sum(a * point[symbol] for symbol, a in row.coefficients.items())),
            slack_by_label[row.label],
        )
        for row in rows
        if row.label in slack_by_label
    ],
    columns=["constraint", "slack by the certificate", "slack by the check"],
).round(6)

# %% [markdown]
# ## Repairs
#
# Each repair changes one number of the mission as little as possible, and optuav verified it by
# solving again. A solver cannot know which repair is cheap: a larger battery, or some seconds more
# time?
#
# **Before you run:** the repair is the smallest on a grid of a certain resolution. What should
# happen one step below it?

# %%
repairs = [repair for repair in explanation.repairs if repair.key == "limits.deadline_s"]
ends_s = [value for repair in repairs for value in (repair.value, repair.value - repair.resolution)]
solved = [
    optuav.solve(mission.replace({"limits.deadline_s": end_s}), problem, perspective="battery")
    for end_s in ends_s
]
pd.DataFrame({"deadline [s]": ends_s, "status": [plan.status.value for plan in solved]})

# %% [markdown]
# ## Physics first
#
# If the drone cannot fly at all, optuav declares no programme. There are still a reason and
# repairs.

# %%
heavy = optuav.explain(optuav.load("paper").replace({"body.mass_kg": 5}))
heavy

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("13.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Times its current, the deadline pays for the rest; the bound of Δ takes the hover out.
answer_1 = {
    "charge": 1,
    "deadline": task["rest_A"],
    "bounds of Δ": task["hover_A"] + task["rest_A"],
}
### END SOLUTION

# %%
grade = exercises.check("13.1", answer_1, student)
print(grade)
