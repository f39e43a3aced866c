# %% [markdown]
# # Hover without a rest
#
# Without a rest there is one unknown: how long to hover. The answer is a division. That makes (P3)
# a good example to see what engines do, and what each of them knows about its answer.
#
# **Learning intentions.** After this page you can
#
# - give one declaration to four engines and compare their answers and proofs;
# - explain why the paper's two wells, though nonlinear, lead to the same hover time;
# - check the answer of an engine independently.

# %%
import math
import sys

import optuav
from optuav.modelling.classify import traits

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Δ shows ? in its place

mission = optuav.load("paper")
program = optuav.formulate(mission, "P3", perspective="battery")
print(program)

# %% [markdown]
# ## By hand
#
# All charge down to η0 may be drawn. The legs take their share, and the rest lasts as long as the
# hover current allows. The deadline of 1200 s does not matter here.

# %%
numbers = program.parts[0].model.row(0)
battery_As = numbers["packs"] * numbers["capacity_As"]
usable_As = (1.0 - numbers["min_soc"]) * battery_As - numbers["flight_charge_As"]
by_hand_s = usable_As / numbers["hover_current_A"]
time_left_s = numbers["deadline_s"] - numbers["flight_time_s"]
print(f"{usable_As:.1f} A s last {by_hand_s:.4f} s; the deadline would allow {time_left_s:.2f} s")

assert by_hand_s < time_left_s
assert math.isclose(by_hand_s, 688.848, abs_tol=1e-3)

# %% [markdown]
# ## Three engines
#
# `closed-form` visits the vertices of a linear programme, `cvxpy` passes it to a simplex code, and
# `grid` tries every whole slot of a second, as the paper does. Each states its proof.

# %%
plans = {
    engine: optuav.solve(mission, "P3", engine=engine, perspective="battery")
    for engine in ("closed-form", "cvxpy", "grid")
}
for engine, plan in plans.items():
    print(f"{engine:<12}{plan.hover_time_s:12.6f} s  {plan.status.value}: {plan.proof}")

assert math.isclose(plans["closed-form"].hover_time_s, by_hand_s, abs_tol=1e-9)
assert math.isclose(plans["cvxpy"].hover_time_s, by_hand_s, abs_tol=1e-6)
assert plans["grid"].hover_time_s == math.floor(by_hand_s)  # whole slots of a second

# %% [markdown]
# ## The fourth: through both wells
#
# The perspective `wells` follows the paper's equations of the kinetic battery, stage by stage:
# charge flows between two wells, and the exponential of the hover time appears. That is no longer
# linear, and the engines for linear models refuse it. CasADi takes it; it finds a *local* optimum,
# and says so.

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

assert not traits(wells.parts[0].model).linear
assert refusal.endswith("bracket, casadi, grid")
assert fourth.status == "locally_optimal"
assert math.isclose(fourth.hover_time_s, by_hand_s, abs_tol=1e-6)

# %% [markdown]
# The answers agree to a microsecond, and they must. What leaves one well enters the other:
# dy1/dt + dy2/dt = I. The sum counts coulombs and does not depend on the flow between the wells. So
# this optimum is global; but the argument shows that, and not the solver.

# %%
for rate_per_s in (0.0, 4.5e-5, 1e-2):
    changed = mission.replace({"battery.flow_rate_per_s": rate_per_s})
    hover_s = optuav.solve(changed, "P3", perspective="wells").hover_time_s
    print(f"flow {rate_per_s:7.1e} per second: {hover_s:.6f} s")
    assert math.isclose(hover_s, by_hand_s, abs_tol=1e-6)

# %% [markdown]
# ## Check the answer, not the engine
#
# All four answers are evaluated in the same statement again, by NumPy. A millisecond more than the
# optimum is too much, and the check shows by how much.

# %%
for plan in (*plans.values(), fourth):
    rows = program.check({"hover_time_s": plan.hover_time_s})
    assert rows.satisfied
(too_long, *_) = program.check({"hover_time_s": by_hand_s + 1e-3})
print(f"{too_long.label}: {too_long.slack:.2e} at a millisecond more, {too_long.declared_at}")

assert not too_long.satisfied
assert math.isclose(too_long.slack, -1e-3 * numbers["hover_current_A"] / battery_As, rel_tol=1e-4)
