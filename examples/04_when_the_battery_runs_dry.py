# %% [markdown]
# # When the battery runs dry
#
# The paper's best plan keeps 5 % of the charge to the end, and yet cannot be flown: the charge is
# in the well that the rotors cannot draw from.
#
# **Learning intentions.** After this page you can
#
# - say when and why a plan with charge left cannot be flown;
# - find the longest hover that a battery can deliver, and compare it with the promised one;
# - read from shadow prices which battery would help.

# %%
import math
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import optuav

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Δ shows ? in its place

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
# Only the available well feeds the rotors. Simulate the direct plan, and look at both wells at the
# moment when it is empty.

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
# It does, but no faster than k_F · B, the flow from a full well into an empty one. The hover takes
# many times that. So charge stays in the bound well, and would flow over only during a rest.

# %%
battery = mission.battery
most_A = battery.flow_rate_per_s * battery.packs * battery.capacity_As
hover_A = -next(each.current_A for each in promised["P3"].phases if each.kind == "hover")
print(f"at most {most_A:.2f} A flow over; hovering takes {hover_A:.2f} A")

assert hover_A > 20.0 * most_A

# %% [markdown]
# ## Overfull as well
#
# A rest does not help. The best one comes first, on b1, when the well is still nearly full: the
# plan relies on charge that does not fit into the well, and it runs dry as well.

# %%
faults = {each.kind: each for each in optuav.replay(promised["P1"]).violations}
print(*faults.values(), sep="\n")

assert set(faults) == {"full", "empty"}
assert math.isclose(faults["empty"].time_s, 1095.5, abs_tol=5e-3)

# %% [markdown]
# ## What can be flown
#
# The perspective `available` adds 0 ≤ y1 ≤ ωB at every moment. The direct hover loses two minutes,
# and another rest is best: after the hover, when it refills the well for the flight home.

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
# These are shadow prices per one percent of each number. Time and the charge to be kept have the
# price 0, because neither limit is reached. The size of the available well matters most; little
# flows into it within ten minutes.

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
