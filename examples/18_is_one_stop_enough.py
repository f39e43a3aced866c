# %% [markdown]
# # Is one stop enough?
#
# The paper rests once, hovers in one piece, and says that more stops never pay. If only the total
# charge counts, that is a theorem. If the battery must not run dry, it is wrong.
#
# **Learning intentions.** After this page you can
#
# - say why one rest is enough in the perspectives of the paper, and what the proof needs;
# - find the best plan with several rests or several hovers, and read its proof;
# - explain from the two wells why a second rest brings hover time.

# %%
import itertools
import math
import sys

import optuav
from optuav.physics.kibam import Wells

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Δ shows ? in its place

mission = optuav.load("paper")

# %% [markdown]
# ## By total charge, one is enough
#
# The charge at the end is linear in the times. So all rest can be moved to the building that
# charges best, and the other stops left out. The flight is then no longer, by the triangle
# inequality.

# %%
for perspective in ("battery", "energy", "adjusted"):
    one = optuav.solve(mission, perspective=perspective)
    more = optuav.solve(mission, optuav.P1(stops=3, hovers=2), perspective=perspective)
    print(f"{perspective:<10}{one.hover_time_s:8.3f} s, with more stops {more.hover_time_s:8.3f} s")
    assert more.phases == one.phases
print(more.notes[-1])

# %% [markdown]
# ## Legs that break the triangle inequality
#
# Suppose that measured legs make b1 → b9 → hover faster than the leg b1 → hover: one is an edge
# from roof to roof, added to the graph. Then all sequences of stops are compared, each by a linear
# programme, and the edge between the roofs brings 20.5 s.

# %%
legs = optuav.graph(mission)
legs.add_edge("b1", "b9", **{**legs.edges["b1", "hover"], "duration_s": 4.0, "charge_As": 50.0})
legs.add_edge("b9", "hover", **{**legs.edges["b9", "hover"], "duration_s": 4.0, "charge_As": 50.0})
windy = [
    optuav.solve(mission, optuav.P1(stops=most), perspective="battery", graph=legs)
    for most in (1, 2)
]
for plan in windy:
    print(f"{plan.hover_time_s:8.3f} s by {' → '.join(plan.route)}")
assert math.isclose(windy[1].hover_time_s - windy[0].hover_time_s, 20.5, abs_tol=0.05)
assert windy[1].route[1:3] == ("b1", "b9")

# %% [markdown]
# ## By the available well, it is not
#
# Under `available` the well that feeds the rotors may never run dry. Rests before and after the
# hover have different effects: the first replaces what the flight out took, the second lets bound
# charge flow over for the flight home. One rest can do only one of the two.

# %%
plans = {
    (stops, hovers): optuav.solve(
        mission, optuav.P1(stops=stops, hovers=hovers), perspective="available"
    )
    for stops, hovers in itertools.product((0, 1, 2), (1, 2))
}
for (stops, hovers), plan in plans.items():
    stays = ", ".join(f"{stop.kind} {stop.at} {stop.duration_s:.2f} s" for stop in plan.stops)
    print(f"rests {stops}, hovers {hovers}: {plan.hover_time_s:8.3f} s  ({stays})")

assert math.isclose(plans[0, 1].hover_time_s, 577.524, abs_tol=1e-3)
assert math.isclose(plans[1, 1].hover_time_s, 597.270, abs_tol=1e-3)
assert math.isclose(plans[2, 1].hover_time_s, 605.456, abs_tol=1e-3)
assert math.isclose(plans[1, 2].hover_time_s, 598.976, abs_tol=1e-3)

# %% [markdown]
# ## What the well does meanwhile
#
# The plan with two rests lands twice with an empty available well: on b10, and at the end. The rest
# in between adds what the laser delivers, and what flows over from the bound well.

# %%
best = plans[2, 1]
print(best.proof)
for phase in best.phases:
    wells = Wells(phase.available_As[0], phase.bound_As[0])
    print(f"{phase.kind:<7}{phase.end_place:<12} y1 {wells.available_As:9.1f} A s")
arrival, rest = (
    next(each for each in best.phases if (each.kind, each.end_place) == (kind, "b10"))
    for kind in ("flight", "rest")
)
charged_As = rest.current_A * rest.duration_s
flowed_As = rest.available_As[0] - arrival.available_As[0] - charged_As
print(f"on b10 {charged_As:.0f} A s from the laser, {flowed_As:.0f} A s from the bound well")
assert abs(arrival.available_As[0]) < 1.0
assert flowed_As > 0.0
assert wells.total_As / optuav.network.vehicle.pool(mission).capacity_As > 0.17

# %% [markdown]
# ## With more time, hover twice
#
# At 2400 s the best plan hovers until the well is empty, rests for 1538 s, and hovers again. A rest
# before the first hover would not help, because the battery is still full.

# %%
longer = mission.replace({"limits.deadline_s": 2400.0})
split = optuav.solve(longer, optuav.P1(hovers=2), perspective="available")
print(split.summary())
assert math.isclose(split.hover_time_s, 742.834, abs_tol=1e-3)
assert optuav.audit(split).flyable
