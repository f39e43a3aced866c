import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Hover without a rest
#
# Without a rest there is one unknown: how long to hover. The answer is a division. That makes (P3)
# a good example to see what engines do, and what each of them knows about its answer.
#
# **Before this lesson:** [Declare a problem](05_declare_a_problem.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - give one declaration to four engines and compare their answers and proofs;
# - explain why the paper's two wells, though nonlinear, lead to the same hover time;
# - check the answer of an engine independently.

# %%
import numpy as np

import optuav
from optuav.modelling.classify import traits

mission = optuav.load("paper")
program = optuav.formulate(mission, "P3", perspective="battery")
if not program.parts:
    raise SystemExit("Nothing can be flown: " + "; ".join(program.reasons))
print(program)

# %% [markdown]
# ## By hand
#
# All charge down to η0 may be drawn. The legs take their share, and the rest lasts as long as the
# hover current allows.
#
# **Before you run:** take B = 72 000 A s, η0 = 5 %, and the numbers printed above, and divide. Does
# the deadline of 1200 s matter?

# %%
numbers = program.parts[0].model.row(0)
if "flight_charge_As" not in numbers:
    raise SystemExit("This page counts charge, as the perspective battery does.")
battery_As = numbers["packs"] * numbers["capacity_As"]
usable_As = (1.0 - numbers["min_soc"]) * battery_As - numbers["flight_charge_As"]
by_hand_s = usable_As / numbers["hover_current_A"]
time_left_s = numbers["deadline_s"] - numbers["flight_time_s"]
print(f"{usable_As:.1f} A s last {by_hand_s:.4f} s; the deadline would allow {time_left_s:.2f} s")

# %% [markdown]
# ## Three engines
#
# `closed-form` visits the vertices of a linear programme, `cvxpy` passes it to a simplex code, and
# `grid` tries every whole slot of a second, as the paper does. Each states its proof.
#
# The proof by duality is a number for each constraint, its *multiplier*. The two constraints are
# $I_\mathrm{hv} \Delta \le$ usable charge and $\Delta \le$ time left. The first, times
# $1 / I_\mathrm{hv}$, and the second, times 0, add up to Δ ≤ the number above: no hover is longer.
#
# **Before you run:** which of the three will give another number than you?

# %%
plans = {
    engine: optuav.solve(mission, "P3", engine=engine, perspective="battery")
    for engine in ("closed-form", "cvxpy", "grid")
}
for engine, plan in plans.items():
    print(f"{engine:<12}{plan.hover_time_s:12.6f} s  {plan.status.value}: {plan.proof}")

# %% [markdown]
# ## The fourth: through both wells
#
# The perspective `wells` follows the paper's equations of the kinetic battery, stage by stage:
# charge flows between two wells, and the exponential of the hover time appears. That is no longer
# linear, and the engines for linear models refuse it. CasADi takes it; it finds a *local* optimum,
# and says so.
#
# **Before you run:** charge that is still bound at the end is of no use to the rotors, and yet this
# perspective only asks for the sum of both wells. Longer than before, shorter, or the same?

# %%
wells = optuav.formulate(mission, "P3", perspective="wells", engine="casadi")
print(traits(wells.parts[0].model))
try:
    optuav.solve(mission, "P3", perspective="wells", engine="closed-form")
except optuav.InputError as error:
    refusal = str(error)
    print(refusal)
fourth = wells.solve()
print(f"{fourth.engine:<12}{fourth.hover_time_s:12.6f} s  {fourth.status.value}: {fourth.proof}")

# %% [markdown]
# In continuous times all agree to a microsecond, and they must. What leaves one well enters the
# other: $dy_1/dt + dy_2/dt = I$. The sum counts coulombs and does not depend on the flow between
# the wells. So this optimum is global; but the argument shows that, and not the solver.
#
# **Before you run:** does the answer change if nothing flows between the wells, or much?

# %%
for rate_per_s in (0.0, 4.5e-5, 1e-2):
    changed = mission.replace({"battery.flow_rate_per_s": rate_per_s})
    hover_s = optuav.solve(changed, "P3", perspective="wells").hover_time_s
    print(f"flow {rate_per_s:7.1e} per second: {hover_s:.6f} s")

# %% [markdown]
# ## Check the answer, not the engine
#
# All four answers are evaluated in the same statement again, by NumPy. A millisecond more than the
# optimum is too much, and the check shows by how much.

# %%
for plan in (*plans.values(), fourth):
    rows = program.check({"hover_time_s": plan.hover_time_s})
    print(f"{plan.engine:<12}", "feasible" if rows.satisfied else "not feasible")
(too_long, *_) = program.check({"hover_time_s": by_hand_s + 1e-3})
print(f"{too_long.label}: {too_long.slack:.2e} at a millisecond more, {too_long.declared_at}")

# %% [markdown]
# ## As a picture
#
# The slack of the state of charge over the hover time, a straight line in this perspective: the
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
    answer_1 = {"charge": Fraction(1, task["hover_A"])}
else:
    answer_1 = {"energy": Fraction(1, task["hover_W"])}
### END SOLUTION

# %%
grade = exercises.check("06.1", answer_1, student)
print(grade)
