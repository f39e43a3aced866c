import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # A bracket, or a solver?
#
# Under `available` the problem is nonlinear. A local solver finds a plan, but does not know whether
# another one is better. The engine `bracket` proves it: no longer hover is feasible.
#
# **Before this lesson:** [When the battery runs dry](04_when_the_battery_runs_dry.py),
# [Convexity and a bad local optimum](10_convexity_and_a_bad_local_optimum.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - say what the answers of `bracket`, `casadi` (IPOPT) and `grid` are worth;
# - give a mission in which a longer hover is feasible and a shorter one is not, and say why;
# - find the longest hovers of thousands of routes at once, from arrays.

# %%
import numpy as np

import optuav
from optuav.judge import Stop
from optuav.physics.kibam import Battery, Stage

mission = optuav.load("paper")
problem = optuav.P4("b10", order="hover-first")
plans = []
for engine, slot_s in {"bracket": None, "casadi": None, "grid": 1.0}.items():
    plans.append(plan := optuav.solve(mission, problem, engine=engine, slot_s=slot_s))
    print(f"{engine:<8}{plan.hover_time_s:9.4f} s  {plan.status.value:<16} {plan.proof}")

bracketed = plans[0]

# %% [markdown]
# The constraints of the wells are curves in the plane, one for each moment at which a well may run
# dry or be full. Here two of them bound the best hover.

# %%
(part,) = optuav.formulate(mission, problem).parts
optuav.plots.plane(part.model, part.model.row(0), [bracketed])

# %% [markdown]
# ## When a shorter hover is infeasible
#
# On `paper`, every hover shorter than a feasible one is feasible, and halving an interval finds the
# longest. But if the laser supplies most of the hover, and the available well is small, the hover
# draws so little that charge flows into the available well.
#
# **Before you run:** the drone below arrives with little in its available well. Can it fly home at
# once? After 350 s of hover?


# %%
def flyable(site, hover_s, *rest):
    stops = (*rest, Stop("hover", "hover", hover_s))
    return optuav.audit(optuav.Itinerary(site, stops)).flyable


strong = {"battery.charge_current_A": 90.0, "laser.power_W": 12_000.0}
small = {"battery.available_fraction": 0.09, "battery.flow_rate_per_s": 2.815e-4}
island = mission.replace(strong | small)
longest = optuav.solve(island, "P3", perspective="available").hover_time_s
print("can be flown:", *(f"{each} s" for each in range(0, 750, 50) if flyable(island, each)))
print(f"the longest: {longest:.1f} s")

# %% [markdown]
# A short hover leaves too little in the available well for the way home; a long one uses up the
# charge. This is what is left in it at the landing, and whether that suffices:


# %%
def left_As(site, hover_s):
    """What a direct flight leaves in the available well [A s]."""
    flown = optuav.replay(optuav.Itinerary(site, [Stop("hover", "hover", hover_s)]))
    return flown.trace.available_As[-1, 0]


hovers_s = np.linspace(0.0, 750.0, 31)
optuav.plots.curves(
    [
        optuav.plots.Line("island", hovers_s, [left_As(island, each) for each in hovers_s]),
        optuav.plots.Line("may not be less", hovers_s, np.zeros_like(hovers_s)),
    ],
    title="Available charge at the landing",
    x_label="hover time Δ [s]",
    y_label="available y1 [A s]",
    marks=[optuav.plots.Mark(longest, "longest")],
)

# %% [markdown]
# A full well can be the limit too: if 90 % of the charge must be kept, a short hover does not
# charge enough, and a long one charges more than fits.
#
# **Before you run:** so what do the feasible hovers look like on a line: one interval from 0, one
# interval that does not begin at 0, or two?

# %%
full = mission.replace(strong | {"battery.charge_current_A": 120.0, "limits.min_soc": 0.9})
most = optuav.solve(full, "P3", perspective="available").hover_time_s
print("can be flown:", *(f"{each} s" for each in range(0, 220, 20) if flyable(full, float(each))))
print(f"the longest: {most:.1f} s")

# %% [markdown]
# ## When rest harms
#
# If the hover charges too, the shortest rest before it is best, so the longest rest is not always
# good. `bracket` divides the plane into boxes until none is left that may contain a better plan.
#
# **Before you run:** ten seconds more of rest add charge. Do they add hover?

# %%
bright = mission.replace({"battery.charge_current_A": 150.0, "laser.power_W": 15_000.0})
best = optuav.solve(bright, optuav.P4("b9", order="rest-first"))
print(f"hover {best.hover_time_s:.2f} s, rest {best.rest_time_s:.2f} s: {best.proof}")
by_rest = {}
for rest_s in (0.0, 10.0, 20.0, 30.0):
    rest = Stop("b9", "rest", rest_s)
    by_rest[rest_s] = next((s for s in range(120, -1, -1) if flyable(bright, s, rest)), None)
print("whole seconds of hover by rest, None if no hover can be flown:", by_rest)

# %% [markdown]
# ## Many routes at once
#
# Here are the direct legs of `paper` with ten thousand batteries, every answer with its proof.
#
# **Before you run:** if hardly any charge is bound, ω = 0.99, how long is the hover? You know this
# number from an earlier lesson.

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
print("all proved:", found.proved.all())
optuav.plots.curves(
    [optuav.plots.Line("ten thousand batteries", shares, found.hover_time_s)],
    title="The longest direct hover, by what is available at once",
    x_label="available share ω of the charge [-]",
    y_label="longest hover Δ [s]",
)

# %% [markdown]
# With hardly any bound charge, the hover is what the paper promises: only the charge to be kept
# ends it.

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

# %%
task = exercises.task("15.2", student)
print(task)

# %%
answer_2 = ...
### BEGIN SOLUTION
# Charging fills the well during the hover, so the longest way to it leaves most room: by way of a
# roof that is passed by. The full well ends the hover.
low_s, high_s = 0.0, 400.0  # the first can be flown, the second not
while high_s - low_s > 0.2:
    hover_s = 0.5 * (low_s + high_s)
    stops = Stop("b2", "rest", 0.0), Stop("hover", "hover", hover_s)
    flown = optuav.audit(optuav.Itinerary(task.mission, stops)).flyable
    low_s, high_s = (hover_s, high_s) if flown else (low_s, hover_s)
answer_2 = [("b2", "rest", 0.0), ("hover", "hover", low_s)]
### END SOLUTION

# %%
grade = exercises.check("15.2", answer_2, student)
print(grade)
