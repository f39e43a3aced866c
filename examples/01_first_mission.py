# %% [markdown]
# # A first mission
#
# A drone flies from an origin to a destination. On its way it hovers within reach of a device on
# the ground for as long as it can, and it may rest once on a roof, where a laser charges it.
#
# **Learning intentions.** After this page you can
#
# - load a mission and look up what it states;
# - solve it and read the plan: where, when, for how long, and which limits bind;
# - distinguish an optimal plan from a plan that can be flown;
# - change a value and say why the answer changes.

# %%
import math
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import optuav

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Δ shows ? in its place

mission = optuav.load("paper")
print(mission.description)
print(f"deadline {mission.limits.deadline_s:g} s, least charge {mission.limits.min_soc:.0%}")
print(f"{mission.battery.packs} packs of {mission.battery.capacity_As:g} A s each")
print(f"{len(mission.buildings)} buildings to rest on")

# %% [markdown]
# ## Solve
#
# `solve` compares the direct flight with a rest on every building, before the hover point and
# after it, and returns the plan with the longest hover.

# %%
plan = optuav.solve(mission, perspective="battery")
print(plan.summary())

assert plan.status == "optimal"
assert plan.route == ("origin", "b1", "hover", "destination")
assert math.isclose(plan.hover_time_s, 719.5399, abs_tol=1e-4)
assert math.isclose(plan.rest_time_s, 392.1438, abs_tol=1e-4)

# %% [markdown]
# ## Check it by hand
#
# Two limits bind, and both can be checked from the phases. Currents are counted into the battery:
# negative while hovering, positive while resting in sight of the laser.

# %%
capacity_As = mission.battery.packs * mission.battery.capacity_As
drawn_As = -sum(phase.current_A * phase.duration_s for phase in plan.phases)
print(f"charge drawn {drawn_As:.1f} A s, allowed {(1 - mission.limits.min_soc) * capacity_As:.1f}")
print(f"time used {plan.mission_time_s:.1f} s, allowed {mission.limits.deadline_s:.1f} s")

assert math.isclose(drawn_As, (1 - mission.limits.min_soc) * capacity_As)
assert math.isclose(plan.mission_time_s, mission.limits.deadline_s)

# %% [markdown]
# ## Optimal, and yet it cannot be flown
#
# The state of charge counts all charge in the battery. But a battery that is drained fast leaves
# part of its charge bound, and stops when the *available* well is empty, here before the landing.
# The paper's problem does not include this limit; the plan checks it and warns.

# %%
for warning in plan.warnings:
    print("Warning:", warning)
last = plan.phases[-1]
print(f"at the end: available {last.available_As[0]:.0f} A s, bound {last.bound_As[0]:.0f} A s")

assert plan.runs_dry_s is not None
assert plan.runs_dry_s < plan.mission_time_s
assert round(100 * last.available_As[0] / capacity_As) == -13
assert math.isclose(last.available_As[0] + last.bound_As[0], 0.05 * capacity_As)

# %% [markdown]
# ## Change a value
#
# A mission never changes; `replace` makes a new one. With a deadline of 800 s there is too little
# time left to rest: the direct flight wins, and charge alone binds.

# %%
hurried = optuav.solve(mission.replace({"limits.deadline_s": 800}), perspective="battery")
print(" → ".join(hurried.route), f"hovers {hurried.hover_time_s:.2f} s; binding:", *hurried.binding)
hover, rest = plan.phases[3], plan.phases[1]
price = -hover.current_A / rest.current_A
print(f"a second of hovering costs as much charge as {price:.2f} s of rest give")

assert (hover.kind, rest.kind) == ("hover", "rest")
assert hurried.rest_time_s == 0.0
assert math.isclose(hurried.hover_time_s, 688.848, abs_tol=1e-3)

# %% [markdown]
# ## Keep the plan
#
# The file contains the mission as well, and reading it gives the same plan, to the last digit.

# %%
with tempfile.TemporaryDirectory() as directory:
    plan.save(Path(directory) / "plan.json")
    assert optuav.load_plan(Path(directory) / "plan.json") == plan

# %% [markdown]
# ## Pictures
#
# `python 01_first_mission.py pictures` writes them into the folder `pictures`.

# %%
if find_spec("matplotlib") and "pictures" in sys.argv[1:]:
    from optuav.plots import save_pictures

    save_pictures(plan, Path("pictures"))
