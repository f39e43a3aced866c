import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Is one stop enough?
#
# The paper rests once, hovers in one piece, and says that more stops never pay. If only the total
# charge counts, that is a theorem. If the battery must not run dry, it is wrong.
#
# **Before this lesson:** [When the battery runs dry](04_when_the_battery_runs_dry.py),
# [Which building?](11_which_building_milp.py).
# **Time:** 35 minutes.
#
# **Learning intentions.** After this page you can
#
# - say why one rest is enough in the perspectives of the paper, and what the proof needs;
# - find the best plan with several rests or several hovers, and read its proof;
# - explain from the two wells why a second rest brings hover time.

# %%
import itertools

import optuav
from optuav.physics.kibam import Wells

mission = optuav.load("paper")

# %% [markdown]
# ## By total charge, one is enough
#
# The charge at the end is linear in the times. So all rest can be moved to the building that
# charges best, and the other stops left out. The flight is then no longer, by the triangle
# inequality.
#
# **Before you run:** up to three rests and two hovers are allowed below. Will they be used?

# %%
for perspective in ("battery", "energy", "adjusted"):
    one = optuav.solve(mission, perspective=perspective)
    more = optuav.solve(mission, optuav.P1(stops=3, hovers=2), perspective=perspective)
    print(f"{perspective:<10}{one.hover_time_s:8.3f} s, with more stops {more.hover_time_s:8.3f} s")
    print("  the same plan:", more.phases == one.phases)
print(more.notes[-1])

# %% [markdown]
# ## Legs that break the triangle inequality
#
# Suppose that measured legs make b1 → b9 → hover faster than the leg b1 → hover: one is an edge
# from roof to roof, added to the graph. Then all sequences of stops are compared, each by a linear
# programme.
#
# **Before you run:** does the drone rest on one of the two roofs, or on both?

# %%
legs = optuav.graph(mission)
legs.add_edge("b1", "b9", **{**legs.edges["b1", "hover"], "duration_s": 4.0, "charge_As": 50.0})
legs.add_edge("b9", "hover", **{**legs.edges["b9", "hover"], "duration_s": 4.0, "charge_As": 50.0})
measured = [
    optuav.solve(mission, optuav.P1(stops=most), perspective="battery", graph=legs)
    for most in (1, 2)
]
for plan in measured:
    print(f"{plan.hover_time_s:8.3f} s by {' → '.join(plan.route)}")

# %% [markdown]
# ## By the available well, it is not
#
# Under `available` the well that feeds the rotors may never run dry. Rests before and after the
# hover have different effects: the first replaces what the flight out took, the second
# refills the well for the flight home. One rest can do only one of the two.
#
# **Before you run:** one rest brings 20 s over the direct flight. How much does a second one bring?
# And a hover in two pieces?

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

# %%
optuav.plots.wells([plans[1, 1], plans[2, 1], plans[1, 2]])

# %% [markdown]
# ## What the well does meanwhile
#
# The plan with two rests lands twice with an empty available well: on b10, and at the end. The rest
# in between adds what the laser delivers, and what flows over from the bound well.
#
# **Before you run:** which of the two is more, in 254 s of rest at 10 A?

# %%
best = plans[2, 1]
print(best.proof)
for phase in best.phases:
    wells = Wells(phase.available_As[0], phase.bound_As[0])
    print(f"{phase.kind:<7}{phase.end_place:<12} y1 {wells.available_As:9.1f} A s")
pairs = [pair for pair in itertools.pairwise(best.phases) if pair[1].kind == "rest"]
for arrival, rest in pairs[-1:]:  # the last rest, if there is one
    charged_As = rest.current_A * rest.duration_s
    flowed_As = rest.available_As[0] - arrival.available_As[0] - charged_As
    print(f"on {rest.end_place} {charged_As:.0f} A s from the laser, ", end="")
    print(f"{flowed_As:.0f} A s from the bound well")

# %% [markdown]
# ## With more time, hover twice
#
# **Before you run:** with a deadline of 2400 s, where would you put one rest among two hovers, and
# for how long?

# %%
longer = mission.replace({"limits.deadline_s": 2400.0})
split = optuav.solve(longer, optuav.P1(hovers=2), perspective="available")
print(split.summary())

# %%
optuav.plots.wells([split])

# %% [markdown]
# The best plan hovers until the well is nearly empty, rests for most of the time, and hovers again.
# A rest before the first hover can only replace what the flight out took: 20 s of hover.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("18.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# The rest before the hover fills the well, the one after it is for the flight home. For some
# lengths of the first rest, halve the interval between hovers that can be flown and that cannot.
from optuav.judge import Stop

best_s = 0.0
for first_s in range(240, 361, 20):
    low_s, high_s = 400.0, 650.0
    while high_s - low_s > 0.5:
        hover_s = 0.5 * (low_s + high_s)
        stops = (
            Stop("b9", "rest", float(first_s)),
            Stop("hover", "hover", hover_s),
            Stop("b10", "rest", 270.0),
        )
        if optuav.audit(optuav.Itinerary(task.mission, stops)).flyable:
            low_s = hover_s
            if hover_s > best_s:
                best_s, best = hover_s, stops
        else:
            high_s = hover_s
letter = next(key for key, reason in task.reasons.items() if "for the way home" in reason)
answer_1 = letter, optuav.Itinerary(task.mission, best)
### END SOLUTION

# %%
grade = exercises.check("18.1", answer_1, student)
print(grade)
