# %% [markdown]
# # Why infeasible?
#
# "Infeasible" alone is a correct answer of little help. Which constraints conflict, how can I check
# that they do, and what should I change?
#
# **Learning intentions.** After this page you can
#
# - read a certificate of infeasibility, and check it with pencil and paper;
# - distinguish constraints that conflict from those that are only violated somewhere;
# - choose among the smallest changes that repair a mission, and verify one.

# %%
import math
import sys
from fractions import Fraction

import optuav

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Δ shows ? in its place

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

assert not plan
assert plan.status == "infeasible"

# %% [markdown]
# ## No single constraint is the reason
#
# Without a rest there is too little charge. With enough rest the deadline is missed. Each
# constraint can be satisfied, but not both together, and trying points can never prove that.

# %%
program = optuav.formulate(mission, problem, perspective="battery")
for rest_s in (0.0, 60.0, 120.0, 180.0):
    rows = program.check({"hover_time_s": 0.0, "rest_time_s": rest_s})
    broken = [f"{row.label} by {-row.slack:.3f}" for row in rows if not row.satisfied]
    print(f"T' = {rest_s:5.1f} s violates {' and '.join(broken)}")
    assert len(broken) == 1

# %% [markdown]
# ## The certificate
#
# Farkas' lemma: linear constraints conflict exactly if some combination of them, each multiplied by
# a number ≥ 0, adds up to something false. `explain` finds the numbers, and uses only constraints
# that are needed.

# %%
explanation = optuav.explain(program)
print(explanation)
(conflict,) = explanation.conflicts
(certificate,) = conflict.certificates

assert certificate.labels == ("P4.a state of charge", "P4.b deadline", "bounds of Δ")

# %% [markdown]
# Check it. The rows read Σ coefficient · unknown ≤ limit, with exact fractions, so that there is no
# rounding error. Every coefficient of the sum must be 0 and its limit negative, which says that
# 0 ≤ a negative number.

# %%
total = {"Δ": Fraction(0), "T'": Fraction(0)}
limit = Fraction(0)
for row in certificate.rows:
    assert row.multiplier >= 0
    limit += row.multiplier * row.limit
    for symbol, coefficient in row.coefficients.items():
        total[symbol] += row.multiplier * coefficient
print("the sum:", *(f"{value}·{symbol} +" for symbol, value in total.items()), f"... ≤ {limit}")

assert total == {"Δ": 0, "T'": 0}
assert limit < 0
assert certificate.holds()

# The rows are those of the statement: at any point, limit less left side is the slack.
point = {"Δ": Fraction(10), "T'": Fraction(20)}
stated = program.check({"hover_time_s": 10.0, "rest_time_s": 20.0})
for row, declared in zip(certificate.rows, stated, strict=False):
    slack = row.limit - sum(a * point[symbol] for symbol, a in row.coefficients.items())
    assert row.label == declared.label
    assert math.isclose(slack, declared.slack, abs_tol=1e-12)

# %% [markdown]
# ## Repairs
#
# Each repair changes one number of the mission as little as possible, and was verified by solving
# again. Which of them is cheap, a solver cannot know: a larger battery, or 5.5 s more time?

# %%
extension = next(each for each in explanation.repairs if each.key == "limits.deadline_s")
for value in (extension.value, extension.value - extension.resolution):
    changed = mission.replace({extension.key: value})
    repaired = optuav.solve(changed, problem, perspective="battery")
    print(f"{extension.key} = {value:g}: {repaired.status.value}")
    assert bool(repaired) == (value == extension.value)

# %% [markdown]
# ## Physics first
#
# If the UAV cannot fly at all, no programme is declared; there are still a reason and repairs.

# %%
heavy = optuav.explain(optuav.load("paper").replace({"body.mass_kg": 5}))
print(heavy)
lighter = next(each for each in heavy.repairs if each.key == "body.mass_kg")

assert heavy.conflicts == ()
assert lighter.value < 17.2158 / 9.8  # full thrust over gravity
