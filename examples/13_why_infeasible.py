import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Why infeasible?
#
# "Infeasible" alone is a correct answer of little help. Which constraints conflict, how can I check
# that they do, and what should I change? (Change the numbers of the mission as you like: where
# nothing conflicts, there is no certificate, and the page says so.)
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

import optuav

mission = optuav.load("paper-table2").replace(
    {"battery.capacity_As": 2900, "limits.deadline_s": 200}  # a lighter drone in a hurry
)
problem = optuav.P4("b1", order="rest-first")
plan = optuav.solve(mission, problem, perspective="battery")
print(plan.summary())
try:
    print(plan.hover_time_s)
except optuav.NoPlanError as error:
    print("NoPlanError:", error)

# %% [markdown]
# ## No single constraint is the reason
#
# Without a rest there is too little charge. With enough rest the deadline is missed. Each
# constraint can be satisfied, but not both together, and trying points can never prove that.
#
# **Before you run:** at which of the four rests below is the charge enough?

# %%
program = optuav.formulate(mission, problem, perspective="battery")
for rest_s in (0.0, 60.0, 120.0, 180.0):
    rows = program.check({"hover_time_s": 0.0, "rest_time_s": rest_s})
    broken = [f"{row.label} by {-row.slack:.3f}" for row in rows if not row.satisfied]
    print(f"T' = {rest_s:5.1f} s violates {' and '.join(broken) or 'nothing'}")

# %% [markdown]
# Each constraint leaves a longest hover for every rest. Where the one is above zero at last, the
# other is below it already:

# %%
rests_s = np.linspace(120.0, 150.0, 61)
slacks = [
    {
        row.label: row.slack
        for row in program.check({"hover_time_s": hover_s + 0 * rests_s, "rest_time_s": rests_s})
    }
    for hover_s in (0.0, 1.0)
]
lines = [optuav.plots.Line("least hover", rests_s, 0.0 * rests_s)]
for label in ("P4.a state of charge", "P4.b deadline"):
    without, one_second = (each[label] for each in slacks)  # linear: each second costs as much
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
print(explanation)
certificates = [each for conflict in explanation.conflicts for each in conflict.certificates]
if not certificates:
    print("No constraints conflict, so that there is nothing to add up.")

# %% [markdown]
# Check it. The rows read Σ coefficient · unknown ≤ limit, with exact fractions, so that there is no
# rounding error.
#
# **Before you run:** what must the coefficients of the sum be, and what its limit, so that no point
# at all can satisfy it?

# %%
point = {"Δ": Fraction(10), "T'": Fraction(20)}
stated = {
    row.label: row.slack for row in program.check({"hover_time_s": 10.0, "rest_time_s": 20.0})
}
for certificate in certificates:
    total = {"Δ": Fraction(0), "T'": Fraction(0)}
    limit = Fraction(0)
    for row in certificate.rows:
        limit += row.multiplier * row.limit
        for symbol, coefficient in row.coefficients.items():
            total[symbol] += row.multiplier * coefficient
    left = " + ".join(f"{value}·{symbol}" for symbol, value in total.items())
    print(f"the sum: {left} ≤ {limit}, which is {float(limit):.6g}")
    print("the certificate holds:", certificate.holds())

    # The rows are those of the statement: at any point, limit less left side is the slack.
    for row in certificate.rows:
        if row.label in stated:
            slack = row.limit - sum(a * point[symbol] for symbol, a in row.coefficients.items())
            print(f"{row.label}: slack {float(slack):.6f}, stated {stated[row.label]:.6f}")

# %% [markdown]
# ## Repairs
#
# Each repair changes one number of the mission as little as possible, and was verified by solving
# again. Which of them is cheap, a solver cannot know: a larger battery, or some seconds more time?
#
# **Before you run:** the repair is the smallest on a grid of a certain resolution. What should
# happen one step below it?

# %%
for repair in explanation.repairs:
    if repair.key == "limits.deadline_s":
        for value in (repair.value, repair.value - repair.resolution):
            changed = mission.replace({repair.key: value})
            repaired = optuav.solve(changed, problem, perspective="battery")
            print(f"{repair.key} = {value:g}: {repaired.status.value}")

# %% [markdown]
# ## Physics first
#
# If the UAV cannot fly at all, no programme is declared; there are still a reason and repairs.

# %%
heavy = optuav.explain(optuav.load("paper").replace({"body.mass_kg": 5}))
print(heavy)

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
