# %% [markdown]
# # When the battery runs dry
#
# The paper's best plan keeps 5 % of the battery to the end, and falls out of the sky. The charge is
# there, but in the well that the rotors cannot reach.
#
# **Learning intentions.** After this page you can
#
# - say when and why a plan with charge left cannot be flown;
# - find the longest hover that a battery can deliver, and what it costs against the promised one;
# - tell from shadow prices which battery would help.

# %%
import math
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import optuav

mission = optuav.load("paper")
promised = {each: optuav.solve(mission, each, perspective="battery") for each in ("P3", "P1")}
for problem, plan in promised.items():
    print(f"{problem}, by {' → '.join(plan.route)}: hover {plan.hover_time_s:.2f} s")
    print(*(f"  {words}" for words in plan.warnings), sep="\n")

assert math.isclose(promised["P3"].hover_time_s, 688.85, abs_tol=5e-3)
assert math.isclose(promised["P1"].hover_time_s, 719.54, abs_tol=5e-3)

# %% [markdown]
# ## Dry, with charge left
#
# All that feeds the rotors is the available well. Simulate the direct plan, and look into both
# wells at the moment at which it is empty.

# %%
falls = optuav.replay(promised["P3"])
dry_s = falls.first_s("empty")
trace = falls.trace
bound_As = float(np.interp(dry_s, trace.time_s, trace.bound_As[:, 0]))
print(f"dry at {dry_s:.2f} s, with {bound_As:.0f} A s still bound")
print(f"that is {trace.time_s[-1] - dry_s:.0f} s before the landing")

assert math.isclose(dry_s, 660.26, abs_tol=5e-3)
assert round(bound_As) == 13_366

# %% [markdown]
# ## Why does it not flow over?
#
# It does, but no faster than k_F · B, which is what flows from a full well into an empty one. The
# hover takes many times that. So the bound well lags behind, and only rest would let it catch up.

# %%
battery = mission.battery
most_A = battery.flow_rate_per_s * battery.packs * battery.capacity_As
hover_A = -next(each.current_A for each in promised["P3"].phases if each.kind == "hover")
print(f"at most {most_A:.2f} A flow over; hovering takes {hover_A:.2f} A")

assert hover_A > 20.0 * most_A

# %% [markdown]
# ## Overfull as well
#
# A rest does not make it right. The best one comes first, on b1, where the well is nearly full
# still: the plan counts on charge that the well has no room for. And it runs dry all the same.

# %%
faults = {each.kind: each for each in optuav.replay(promised["P1"]).violations}
print(*faults.values(), sep="\n")

assert set(faults) == {"full", "empty"}
assert math.isclose(faults["empty"].time_s, 1095.5, abs_tol=5e-3)

# %% [markdown]
# ## What can be flown
#
# Perspective `available` adds 0 ≤ y1 ≤ ωB at every moment. The direct hover loses two minutes, and
# another rest wins: after the hover, where it refills the well for the flight home.

# %%
flown = {each: optuav.solve(mission, each, perspective="available") for each in ("P3", "P1")}
for problem, plan in flown.items():
    lost_s = promised[problem].hover_time_s - plan.hover_time_s
    print(f"{problem}, by {' → '.join(plan.route)}: {plan.hover_time_s:.2f} s, {lost_s:.1f} s less")
    assert optuav.audit(plan).flyable

assert not any(optuav.audit(plan).flyable for plan in promised.values())
assert math.isclose(flown["P3"].hover_time_s, 577.52, abs_tol=5e-3)
assert math.isclose(flown["P1"].hover_time_s, 597.27, abs_tol=5e-3)
assert flown["P1"].route == ("origin", "hover", "b10", "destination")

# %% [markdown]
# ## Which battery would help?
#
# Shadow prices, per one percent of each number. Time and the charge to be kept are worth nothing:
# neither limit is reached. What counts is the size of the available well; what flows into it within
# ten minutes is little.

# %%
program = optuav.formulate(mission, "P1", perspective="available")
given, prices = program.parts[0].model.row(0), program.shadow_prices()
for name in ("capacity_As", "available_fraction", "flow_rate_per_s", "deadline_s", "min_soc"):
    percent_s = 0.01 * given[name] * prices[name].more
    print(f"one percent more {name:<20}{percent_s:8.3f} s of hover")

assert prices["deadline_s"].more == prices["min_soc"].more == 0.0
assert prices["available_fraction"].more > 0.0 < prices["flow_rate_per_s"].more

# %%
if find_spec("matplotlib") and "pictures" in sys.argv[1:]:
    from optuav import plots

    Path("pictures").mkdir(exist_ok=True)
    figure = plots.wells([promised["P3"], flown["P3"], promised["P1"], flown["P1"]])[0].figure
    figure.savefig("pictures/wells.png")
