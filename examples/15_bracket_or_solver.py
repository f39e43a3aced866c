# %% [markdown]
# # A bracket, or a solver?
#
# Under `available` the problem is nonlinear. A local solver finds a plan, but does not know whether
# another one is better. The engine `bracket` proves it: no longer hover is feasible.
#
# **Learning intentions.** After this page you can
#
# - say what the answers of `bracket`, `casadi` (IPOPT) and `grid` are worth;
# - give a mission in which a longer hover is feasible and a shorter one is not, and say why;
# - find the longest hovers of thousands of itineraries at once, from arrays.

# %%
import math
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import optuav
from optuav.judge import Stop
from optuav.physics.kibam import Battery, Stage

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Δ shows ? in its place

mission = optuav.load("paper")
problem = optuav.P4("b10", order="hover-first")
plans = []
for engine, slot_s in {"bracket": None, "casadi": None, "grid": 1.0}.items():
    plans.append(plan := optuav.solve(mission, problem, engine=engine, slot_s=slot_s))
    print(f"{engine:<8}{plan.hover_time_s:9.4f} s  {plan.status.value:<16} {plan.proof}")

bracketed, local, cells = plans
assert math.isclose(bracketed.hover_time_s, local.hover_time_s, abs_tol=1e-6)
assert 0.0 <= bracketed.hover_time_s - cells.hover_time_s < 2.0

# %% [markdown]
# ## When a shorter hover is infeasible
#
# On `paper`, every hover shorter than a feasible one is feasible, and halving an interval finds the
# longest. But if the laser supplies most of the hover, and the available well is small, the hover
# draws so little that charge flows into the available well. A short hover leaves too little in it
# for the way home.


# %%
def flyable(site, hover_s, *rest):
    stops = (*rest, Stop("hover", "hover", hover_s))
    return optuav.audit(optuav.Itinerary(site, stops)).flyable


strong = {"battery.charge_current_A": 90.0, "laser.power_W": 12_000.0}
small = {"battery.available_fraction": 0.09, "battery.flow_rate_per_s": 2.815e-4}
island = mission.replace(strong | small)
longest = optuav.solve(island, "P3", perspective="available").hover_time_s
print("can be flown:", *(f"{each} s" for each in range(0, 750, 50) if flyable(island, each)))

assert math.isclose(longest, 678.3, abs_tol=0.1)
assert [flyable(island, each) for each in (0.0, 300.0, 350.0, 650.0)] == [False, False, True, True]
assert not flyable(island, longest + 1.0)

# %% [markdown]
# A full well can be the limit too: if 90 % of the charge must be kept, a short hover does not
# charge enough, and a long one charges more than fits.

# %%
full = mission.replace(strong | {"battery.charge_current_A": 120.0, "limits.min_soc": 0.9})
most = optuav.solve(full, "P3", perspective="available").hover_time_s
print("can be flown:", *(f"{each} s" for each in range(0, 220, 20) if flyable(full, float(each))))

assert math.isclose(most, 176.5, abs_tol=0.1)
assert [flyable(full, each) for each in (20.0, 40.0, 160.0, 180.0)] == [False, True, True, False]

# %% [markdown]
# ## When rest harms
#
# If the hover charges too, the shortest rest before it is best, so the longest rest is not always
# good. `bracket` divides the plane into boxes until none is left that may contain a better plan.

# %%
bright = mission.replace({"battery.charge_current_A": 150.0, "laser.power_W": 15_000.0})
best = optuav.solve(bright, optuav.P4("b9", order="rest-first"))
print(f"hover {best.hover_time_s:.2f} s, rest {best.rest_time_s:.2f} s: {best.proof}")
by_rest = {}
for rest_s in (0.0, 10.0, 20.0, 30.0):
    rest = Stop("b9", "rest", rest_s)
    by_rest[rest_s] = next((s for s in range(120, -1, -1) if flyable(bright, s, rest)), None)
print("whole seconds of hover by rest:", by_rest)

assert math.isclose(best.hover_time_s, 106.0, abs_tol=0.05)
assert list(by_rest.values()) == [106, 77, 48, None]

# %% [markdown]
# ## Many itineraries at once
#
# Here are the direct legs of `paper` with ten thousand batteries, every answer with its proof. With
# hardly any bound charge, the hover is what the paper promises: only the charge to be kept ends it.

# %%
out, _, home = optuav.solve(mission, "P3", perspective="available").phases
ways = [[Stage(each.current_A, each.duration_s) for each in leg.stages] for leg in (out, home)]
figures = optuav.formulate(mission, "P3", perspective="available").parts[0].model.row(0)
given = {name: figures[name] for name in ("deadline_s", "min_soc", "hover_current_A")}
shares = np.linspace(0.3, 0.99, 10_000)
steps, battery = [*ways[0], "hover", *ways[1]], Battery(72_000.0, shares, 4.5e-5)
found = optuav.longest_hovers(steps, battery=battery, **given)
for share in (0.4, 0.6, 0.8, 0.99):
    print(f"ω = {share:.2f}: {np.interp(share, shares, found.hover_time_s):.2f} s")

assert found.proved.all()
assert math.isclose(found.hover_time_s[-1], 688.85, abs_tol=5e-3)
assert math.isclose(np.interp(0.8, shares, found.hover_time_s), 577.52, abs_tol=0.01)

# %%
if find_spec("matplotlib") and "pictures" in sys.argv[1:]:
    from optuav import plots

    (part,) = optuav.formulate(mission, problem).parts
    Path("pictures").mkdir(exist_ok=True)
    plots.plane(part.model, part.model.row(0), [bracketed]).figure.savefig("pictures/feasible.png")
