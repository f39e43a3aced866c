# %% [markdown]
# # Hover without a rest
#
# Without a rest there is one unknown: how long to hover. The answer is a division. That makes (P3)
# a good example to see how engines work, and how much each of them knows about its answer.
#
# **Before this lesson:** [Declare a problem](05_declare_a_problem.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - give one declaration to four engines and compare their answers and proofs;
# - say what the paper's two wells, which are nonlinear, change about the hover time, and why;
# - check the answer of an engine independently.

# %%
import numpy as np
import pandas as pd

import optuav

pd.set_option("display.max_colwidth", None)  # Proofs in full
mission = optuav.load("paper")
program = optuav.formulate(mission, "P3", perspective="battery")
program

# %% [markdown]
# ## By hand
#
# The drone may draw all charge down to the share η0. The legs take their share, and the hover
# current draws the rest.
#
# **Before you run:** take B = 72 000 A s, η0 = 5 %, and the numbers of the programme above (open
# *where*), and divide. Does the deadline of 1200 s matter?

# %%
numbers = program.parts[0].model.row(0)
battery_As = numbers["packs"] * numbers["capacity_As"]
usable_As = (1.0 - numbers["min_soc"]) * battery_As - numbers["flight_charge_As"]
by_hand_s = float(usable_As / numbers["hover_current_A"])
time_left_s = float(numbers["deadline_s"] - numbers["flight_time_s"])
{"charge lasts for [s]": by_hand_s, "deadline allows [s]": time_left_s}

# %% [markdown]
# ## Three engines
#
# `closed-form` visits the vertices of a linear programme, `cvxpy` passes it to a simplex code, and
# `grid` tries every whole slot of a second, as the paper does. Each states its proof.
#
# **Before you run:** by how much will each of the three differ from your number?

# %%
plans = {
    engine: optuav.solve(mission, "P3", engine=engine, perspective="battery")
    for engine in ("closed-form", "cvxpy", "grid")
}


def answers(plans):
    """Return a table of answers by engine."""
    rows = [(plan.engine, plan.hover_time_s, plan.status.value, plan.proof) for plan in plans]
    return pd.DataFrame(rows, columns=["engine", "hover [s]", "status", "proof"])


answers(plans.values())

# %% [markdown]
# `grid` finds the best whole second, which is below the optimum. The proof by duality is a
# number for each constraint, its *multiplier*. The two constraints are $I_\mathrm{hv} \Delta \le$
# usable charge and $\Delta \le$ time left. Multiplied by these numbers they add up to Δ ≤ the
# optimum: no hover is longer.

# %% [markdown]
# ## The fourth: through both wells
#
# The perspective `wells` follows the paper's equations of the kinetic battery, stage by stage:
# charge flows between two wells, and the exponential of the hover time appears. That is no longer
# linear, and the engines for linear models refuse it:

# %%
try:
    refusal = optuav.solve(mission, "P3", perspective="wells", engine="closed-form")
except optuav.InputError as error:
    refusal = str(error)
refusal

# %% [markdown]
# CasADi takes it. It finds a *local* optimum, and says so.
#
# **Before you run:** charge that is still bound at the end is of no use to the rotors, and yet this
# perspective only asks for the sum of both wells. Longer than before, shorter, or the same?

# %%
wells = optuav.formulate(mission, "P3", perspective="wells", engine="casadi")
fourth = wells.solve()
answers([fourth])

# %% [markdown]
# The three engines that do not count whole seconds agree to a microsecond, and they must. What
# leaves one well enters the other: $dy_1/dt + dy_2/dt = I$. The sum counts coulombs and does not
# depend on the flow between the wells. So this optimum is global. The argument shows that, and not
# the solver.
#
# **Before you run:** does the answer change if nothing flows between the wells, or if much does?

# %%
rates_per_s = (0.0, 4.5e-5, 1e-2)
by_rate_s = {
    rate_per_s: optuav.solve(
        mission.replace({"battery.flow_rate_per_s": rate_per_s}), "P3", perspective="wells"
    ).hover_time_s
    for rate_per_s in rates_per_s
}
pd.Series(by_rate_s, name="hover [s]").rename_axis("flow [1/s]").to_frame()

# %% [markdown]
# ## Check the answer, not the engine
#
# NumPy evaluates all four answers in the same statement again.

# %%
{
    plan.engine: program.check({"hover_time_s": plan.hover_time_s}).satisfied
    for plan in (*plans.values(), fourth)
}

# %% [markdown]
# A millisecond more than the optimum is too much, and the check shows by how much.

# %%
rows = program.check({"hover_time_s": by_hand_s + 1e-3})
rows

# %% [markdown]
# ## As a picture
#
# The slack of the state of charge over the hover time is a straight line in this perspective. The
# answer is where it crosses zero.

# %%
hovers_s = np.linspace(0.0, 900.0, 181)
slack = program.check({"hover_time_s": hovers_s})[0].slack
optuav.plots.curves(
    [optuav.plots.Line("state of charge at the end, less η0", hovers_s, 100.0 * slack)],
    title="How much charge is left over",
    x_label="hover time Δ [s]",
    y_label="slack [% of B]",
    marks=[optuav.plots.Mark(by_hand_s, "longest hover")],
)

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("06.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Each row reads Δ ≤ a number; the row with the least number binds.
from fractions import Fraction

by_charge = Fraction(task["usable_As"], task["hover_A"])
by_energy = Fraction(task["energy_J"], task["hover_W"])
if by_charge <= by_energy:
    least, label, multiplier = by_charge, "charge", Fraction(1, task["hover_A"])
else:
    least, label, multiplier = by_energy, "energy", Fraction(1, task["hover_W"])
# A mean of this bound and the deadline's, 1100 s, is a bound as well.
share = (1100 - task["claim_s"]) / (1100 - least)
answer_1 = [{label: multiplier}, {label: share * multiplier, "deadline": 1 - share}]
### END SOLUTION

# %%
grade = exercises.check("06.1", answer_1, student)
print(grade)
