# %% [markdown]
# # A bracket, or a solver?
#
# Under `available` the problem is nonlinear. A local solver finds a plan, but does not know whether
# another one is better. The engine `bracket` proves that no longer hover is feasible.
#
# **Before this lesson:** [When the battery runs dry](04_when_the_battery_runs_dry.py),
# [Convexity and a bad local optimum](10_convexity_and_a_bad_local_optimum.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - compare the answers of `bracket`, `casadi` (IPOPT) and `grid`, and say what each proves;
# - give a mission in which a longer hover is feasible and a shorter one is not, and say why;
# - find the longest hovers of thousands of routes at once, from arrays.

# %%
import numpy as np
import pandas as pd

import optuav
from optuav.physics.kibam import Battery, Stage

Line, Mark = optuav.plots.Line, optuav.plots.Mark
mission = optuav.load("paper")
problem = optuav.P4("b10", order="hover-first")
pd.options.display.max_colwidth = None

# %% [markdown]
# **Before you run:** three engines look for the longest hover: one by a proof, one along slopes,
# one in slots of a second. Which of the three find the same hover?

# %%
plans = {
    engine: optuav.solve(mission, problem, engine=engine, slot_s=slot_s)
    for engine, slot_s in {"bracket": None, "casadi": None, "grid": 1.0}.items()
}
pd.DataFrame(
    [(name, plan.hover_time_s, plan.status.value, plan.proof) for name, plan in plans.items()],
    columns=["engine", "hover [s]", "status", "proof"],
)

# %% [markdown]
# Each limit of the wells is a curve in the plane, one for each moment at which a well may run dry
# or be full. Here two curves bound the best hover.

# %%
(part,) = optuav.formulate(mission, problem).parts
optuav.plots.plane(part.model, part.model.row(0), [plans["bracket"]])

# %% [markdown]
# ## When a shorter hover is infeasible
#
# On `paper`, every hover shorter than a feasible one is feasible, and halving an interval finds the
# longest. But suppose that the laser supplies most of the hover, and that the available well is
# small. Then the hover draws so little that charge flows into the available well.
#
# **Before you run:** the drone below arrives with little in its available well. Can it fly home at
# once? After 350 s of hover?


# %%
def flight(site, hover_s, *rest):
    return optuav.replay(optuav.Itinerary(site, (*rest, optuav.Stop("hover", "hover", hover_s))))


def hovers(site, hovers_s):
    """Whether a direct flight with each hover can be flown, and what it leaves available."""
    flights = [flight(site, float(hover_s)) for hover_s in hovers_s]
    left_As = [flown.trace.available_As[-1, 0] for flown in flights]
    return pd.DataFrame(
        {"flyable": [flown.flyable for flown in flights], "available at landing [A s]": left_As},
        index=pd.Index(hovers_s, name="hover [s]"),
    )


strong = {"battery.charge_current_A": 90.0, "laser.power_W": 12_000.0}
small = {"battery.available_fraction": 0.09, "battery.flow_rate_per_s": 2.815e-4}
island = mission.replace(strong | small)
on_island = hovers(island, range(0, 750, 25))
on_island[::4]

# %%
longest = optuav.solve(island, "P3", perspective="available").hover_time_s
optuav.plots.curves(
    [
        Line("island", on_island.index, on_island["available at landing [A s]"]),
        Line("may not be less", on_island.index, np.zeros(len(on_island))),
    ],
    title="Available charge at the landing",
    x_label="hover time Δ [s]",
    y_label="available y1 [A s]",
    marks=[Mark(longest, "longest")],
)

# %% [markdown]
# A short hover leaves too little in the available well for the way home; a long one uses up the
# charge. A search that halves the interval from 0 takes for granted that this cannot happen.
#
# A full well can be the limit too. Suppose that the hover charges the battery, and that 90 % of the
# charge must be kept.
#
# **Before you run:** what do the feasible hovers look like on a line: one interval from 0, one
# interval that does not begin at 0, or two?

# %%
full = mission.replace(strong | {"battery.charge_current_A": 120.0, "limits.min_soc": 0.9})
most = optuav.solve(full, "P3", perspective="available").hover_time_s
charging = hovers(full, range(0, 220, 20))
charging

# %% [markdown]
# One interval that does not begin at 0: a short hover does not charge enough, and a long one
# charges more than fits.

# %% [markdown]
# ## When rest harms
#
# If the hover charges too, the shortest rest before it is best, so the longest rest is not always
# good. `bracket` divides the plane into boxes until no box is left that may contain a better plan.
#
# **Before you run:** ten more seconds of rest add charge. Do they add hover?

# %%
bright = mission.replace({"battery.charge_current_A": 150.0, "laser.power_W": 15_000.0})
best = optuav.solve(bright, optuav.P4("b9", order="rest-first"))
best


# %%
def longest_by_tries(site, rest_s):
    """Longest hover in whole seconds after a rest on b9, or None."""
    tried = range(120, -1, -1)
    return next(
        (s for s in tried if flight(site, s, optuav.Stop("b9", "rest", rest_s)).flyable), None
    )


by_rest = {rest_s: longest_by_tries(bright, rest_s) for rest_s in (0.0, 10.0, 20.0, 30.0)}
pd.Series(by_rest, name="longest hover by rest [s]").to_frame()

# %% [markdown]
# The plan that `bracket` proves best does not rest. Each ten seconds of rest cost 29 s of hover,
# since the battery is full sooner. After 30 s of rest no hover can be flown.
#
# ## Many routes at once
#
# Here are the direct legs of `paper` with ten thousand batteries, every answer with its proof.
#
# **Before you run:** if hardly any charge is bound, ω = 0.99, how long is the hover? You know this
# number from an earlier lesson.

# %%
out, _, home = optuav.solve(mission, "P3", perspective="available").phases
ways = [[Stage(stage.current_A, stage.duration_s) for stage in leg.stages] for leg in (out, home)]
figures = optuav.formulate(mission, "P3", perspective="available").parts[0].model.row(0)
limits = {name: figures[name] for name in ("deadline_s", "min_soc", "hover_current_A")}
shares = np.linspace(0.3, 0.99, 10_000)
steps, battery = [*ways[0], "hover", *ways[1]], Battery(72_000.0, shares, 4.5e-5)
batch = optuav.longest_hovers(steps, battery=battery, **limits)
optuav.plots.curves(
    [Line("ten thousand batteries", shares, batch.hover_time_s)],
    title="The longest direct hover, by what is available at once",
    x_label="available share ω of the charge [-]",
    y_label="longest hover Δ [s]",
)

# %%
bool(batch.proved.all()), float(batch.hover_time_s[-1])

# %% [markdown]
# With hardly any bound charge, the hover is what the paper promises: only the charge that
# must be kept ends it.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("15.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Too short below, flyable above: halve the interval between them.
from optuav.judge import Stop

fails_s, flies_s = 0.0, 500.0
while flies_s - fails_s > 0.5:
    middle_s = 0.5 * (fails_s + flies_s)
    flown = optuav.audit(optuav.Itinerary(task.mission, [Stop("hover", "hover", middle_s)]))
    fails_s, flies_s = (fails_s, middle_s) if flown.flyable else (middle_s, flies_s)
letter = next(key for key, reason in task.reasons.items() if "nearly empties" in reason)
answer_1 = letter, {"flies_s": flies_s, "fails_s": fails_s}
### END SOLUTION

# %%
grade = exercises.check("15.1", answer_1, student)
print(grade)
