# %% [markdown]
# # Is one stop enough?
#
# The paper rests once, hovers in one piece, and says that more stops never pay. Is that so? It
# depends on what must not run out.
#
# **Before this lesson:** [When the battery runs dry](04_when_the_battery_runs_dry.py),
# [Which building?](11_which_building_milp.py).
# **Time:** 35 minutes.
#
# **Learning intentions.** After this page you can
#
# - say when one rest is enough, and what the proof needs;
# - find the best plan with several rests or several hovers, and read its proof;
# - explain from the two wells what a rest before the hover does, and what one after it does.

# %%
import itertools

import pandas as pd

import optuav

mission = optuav.load("paper")

# %% [markdown]
# ## By total charge, one is enough
#
# The charge at the end is linear in the times. So all rest can be moved to the building that
# charges best, and the other stops can be left out. The flight is then no longer, by the triangle
# inequality. This holds if the reserve counts at the end only, as it does here. With
# `limits.keep_soc = "always"` it also counts at every landing, and then more stops may help:
# the building that charges best may come too late.
#
# **Before you run:** up to three rests and two hovers are allowed below. Will the plan use them?

# %%
perspectives = ("battery", "energy", "adjusted")
one = {name: optuav.solve(mission, perspective=name) for name in perspectives}
more = {
    name: optuav.solve(mission, optuav.P1(stops=3, hovers=2), perspective=name)
    for name in perspectives
}
pd.DataFrame(
    [
        (
            name,
            one[name].hover_time_s,
            more[name].hover_time_s,
            one[name].phases == more[name].phases,
        )
        for name in perspectives
    ],
    columns=["perspective", "one stop [s]", "more stops [s]", "same plan"],
)

# %% [markdown]
# ## Legs that break the triangle inequality
#
# Suppose that somebody measured the legs, and that b1 → b9 → hover is faster than b1 → hover. One
# of these legs goes from roof to roof, so it is an edge that you add to the graph. optuav then
# compares all sequences of stops, each by a linear programme.
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
measured[1].to_frame()[["kind", "start_place", "end_place", "duration_s"]]

# %%
measured[1].hover_time_s - measured[0].hover_time_s

# %% [markdown]
# The plan passes by one of the two roofs, and rests on the other. Passing by gains 20 s of hover
# here, since the leg that it avoids is the slow one. All rest still stands on one roof.
#
# ## By the available well
#
# Under `available` the well that feeds the rotors may never run dry. So it matters *when* charge
# arrives: a rest before the hover replaces what the flight out took, and a rest after it refills
# the well for the flight home.
#
# **Before you run:** one rest gains 20 s over the direct flight. How much does a second rest gain?
# And a hover in two pieces?

# %%
plans = {
    (stops, hovers): optuav.solve(
        mission, optuav.P1(stops=stops, hovers=hovers), perspective="available"
    )
    for stops, hovers in itertools.product((0, 1, 2), (1, 2))
}
pd.DataFrame(
    [(*key, plan.hover_time_s, " → ".join(plan.route)) for key, plan in plans.items()],
    columns=["rests allowed", "hovers allowed", "hover [s]", "route"],
)

# %% [markdown]
# A second rest lengthens the hover by 8 s more, so one stop is *not* enough. One rest can replace
# what the flight out took, or it can refill the well for the way home. It cannot do both.

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
best

# %%
pairs = [pair for pair in itertools.pairwise(best.phases) if pair[1].kind == "rest"]
gained = pd.DataFrame(
    [
        (
            rest.end_place,
            rest.current_A * rest.duration_s,
            rest.available_As[0] - arrival.available_As[0] - rest.current_A * rest.duration_s,
        )
        for arrival, rest in pairs
    ],
    columns=["rest on", "from the laser [A s]", "from the bound well [A s]"],
)
gained.round(1)

# %% [markdown]
# ## With more time, hover twice
#
# **Before you run:** with a deadline of 2400 s, where would you put one rest among two hovers, and
# for how long?

# %%
longer = mission.replace({"limits.deadline_s": 2400.0})
split = optuav.solve(longer, optuav.P1(hovers=2), perspective="available")
optuav.plots.wells([split])

# %%
split

# %% [markdown]
# The best plan hovers until the well is nearly empty, rests for most of the time, and hovers again.
# A rest before the first hover can replace only what the flight out took, which is worth 20 s of
# hover.

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
