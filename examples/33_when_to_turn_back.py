# %% [markdown]
# # When to turn back
#
# The plan says when to leave the hover point. In the air nobody knows whether the drone draws what
# the file says. Autopilots return by a clock, by the charge, or by an average of both. This lesson
# finds a rule that never lets the available well run dry on the way home. Ten thousand simulated
# flights then measure what each thing that the drone knows is worth.
#
# **Before this lesson:** [Two wells](03_two_wells.py),
# [When the battery runs dry](04_when_the_battery_runs_dry.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - state the rule "leave when $a y_1 + b y_2 < g$", and compute its three numbers;
# - compare a rule by the charge with a rule by the two wells;
# - say what measuring gains over a clock, by a simulation with stated seeds.

# %%
import numpy as np
import pandas as pd

import optuav
from optuav.physics.kibam import Battery, Stage, start, tilted_after

mission = optuav.load("paper")
plan = optuav.solve(mission, "P3")
plan

# %% [markdown]
# ## The rule
#
# A flight of the duration $T$ takes some charge out of the available well, and lets some flow into
# it from the bound one. The model is linear, so the available well is left at the landing with
#
# $$ a y_1 + b y_2 - g, \qquad e = e^{-k'T},\quad a = \omega(1 - e) + e,\quad b = \omega(1 - e). $$
#
# As long as that is positive, the drone can still come home.
#
# **Before you run:** the way home takes 38 s. Compared with $a y_1$, how much will $b y_2$ count?
# The plan leaves after 577.5 s. How much longer could it stay if only the total charge counted?

# %%
times = optuav.return_by(mission)
row = times.rows[0]  # Straight home
times

# %%
times.plot()["return.png"]

# %% [markdown]
# Within 38 s hardly anything flows between the wells: $a$ is nearly one and $b$ nearly zero. Leave
# when the available well holds about what the flight draws. The total charge is misleading, though:
# by `soc_s`, there would be almost two minutes more.
#
# ## Ten thousand flights
#
# In each flight the drone draws its stated currents times a number between 0.85 and 1.15, the same
# for the whole flight, that nobody knew before. Four drones fly home directly:
#
# - **the clock** leaves after the longest time that is safe for every such number;
# - **charge** leaves when the charge falls below one threshold that is safe for every number;
# - **wells** leaves by the rule above, with the $g$ of the largest number;
# - **drain known** has worked out the number from the charge that the flight took so far.
#
# **Before you run:** order them, and guess by how many seconds each beats the one before.

# %%
SPREAD, FLIGHTS, SEED = 0.15, 10_000, 0
out, hover, home = plan.phases
battery = Battery(
    mission.battery.packs * mission.battery.capacity_As,
    mission.battery.available_fraction,
    mission.battery.flow_rate_per_s,
)
LIT_A = mission.battery.charge_current_A  # The laser has more light than the charger takes
drawn_A = LIT_A - hover.current_A


def flown(phase, drain):
    """Stages of a flight whose currents are multiplied by the drain."""
    return [Stage(drain * stage.current_A, stage.duration_s) for stage in phase.stages]


def arrived(drain):
    """Charge on arrival at the hover point."""
    return tilted_after(battery, start(battery), *flown(out, drain))


def hovered(drain, hover_s):
    """Charge after a hover."""
    return tilted_after(battery, arrived(drain), Stage(LIT_A - drain * drawn_A, hover_s))


def left_As(drain, hover_s, way=None):
    """What the available well holds at the landing, by the drain of the way home."""
    way = flown(home, drain if way is None else way)
    return tilted_after(battery, hovered(drain, hover_s), *way).wells(battery).available_As


def latest_s(enough):
    """The last moments at which a condition on the hovers holds, by bisection."""
    low_s, high_s = np.zeros(FLIGHTS), np.full(FLIGHTS, 2000.0)
    for _ in range(50):
        between_s = 0.5 * (low_s + high_s)
        holds = enough(between_s)
        low_s, high_s = np.where(holds, between_s, low_s), np.where(holds, high_s, between_s)
    return low_s


drain = np.random.default_rng(SEED).uniform(1.0 - SPREAD, 1.0 + SPREAD, FLIGHTS)
drain[:2] = 1.0 - SPREAD, 1.0 + SPREAD
known_s = latest_s(lambda hover_s: left_As(drain, hover_s) >= 0.0)
threshold_As = hovered(drain, known_s).total_As.max()
hover_s = {
    "clock": np.full(FLIGHTS, known_s.min()),
    "charge": latest_s(lambda hover_s: hovered(drain, hover_s).total_As >= threshold_As),
    "wells": latest_s(lambda hover_s: left_As(drain, hover_s, 1.0 + SPREAD) >= 0.0),
    "drain known": known_s,
}
means_s = {name: float(times_s.mean()) for name, times_s in hover_s.items()}
pd.Series(means_s, name="mean hover [s]").round(1).to_frame()

# %%
optuav.plots.curves(
    [
        optuav.plots.Line(name, np.sort(drain), times_s[drain.argsort()])
        for name, times_s in hover_s.items()
    ],
    title="When each drone leaves",
    x_label="drain, relative to what the mission states",
    y_label="hover [s]",
)

# %% [markdown]
# The clock has to fear the worst in every flight. Any measurement beats it by far, and that is most
# of the gain. Wells in place of the charge add hardly two seconds here, and knowing the drain adds
# some seven more.
#
# **Before you run:** does each of the four drones come home in every flight?

# %%
least_As = {name: float(left_As(drain, times_s).min()) for name, times_s in hover_s.items()}
pd.Series(least_As, name="least charge at landing [A s]").round(3).to_frame()

# %% [markdown]
# ## Solve again
#
# A drone that rests on the way has more to decide: how long to rest, and where. On `matrice350` the
# drain multiplies the currents of its flight table. One plan has to hold for all of them; or the
# drone measures, and solves again.
#
# **Before you run:** the plan for everything within 10 % hovers for 24.7 minutes. How much longer
# would the drone hover on average if it solved again?

# %%
relay = optuav.load("matrice350")
kept = optuav.robust(relay, {"drain": {"percent": 10}})
tables = ("flight.flight_current_A", "flight.hover_current_A", "flight.rest_current_A")
factors = np.random.default_rng(SEED).uniform(0.9, 1.1, FLIGHTS)
flight_table = {key: getattr(relay.flight, key.partition(".")[2]) for key in tables}
columns = {key: factors * value for key, value in flight_table.items() if value}
again = optuav.batch_arrays(relay, columns, paired=True)["hover_time_s"].ravel()
pd.Series(
    {"one plan": kept.hover_s, "solved again, mean": again.mean()}, name="hover [s]"
).to_frame()

# %% [markdown]
# This simulation knows the drain from the start, so it shows the most that measuring and solving
# again can gain together. They gain most while the rest can still be changed. No new theory is
# needed: state the present wells and place in `[start]` and `route.origin_m`, and call `solve`.
#
# `return_by` keeps the reserve at the landing. On `matrice350` `solve` does so too, on a roof as at
# the end (`limits.keep_soc = "always"`). With `"end"` a plan may land on a roof with less, and
# recharge.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("33.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Halve the interval between a well that is enough and one that is not.
from optuav.physics import kibam

pack = kibam.Battery(72_000, task["available_fraction"], task["flow_rate_per_s"])
way = kibam.Stage(-task["flight_A"], task["flight_s"])
dry_As, home_As = 0.0, float(task["total_As"])
while home_As - dry_As > 10.0:
    middle_As = 0.5 * (dry_As + home_As)
    landed = kibam.step(pack, kibam.Wells(middle_As, task["total_As"] - middle_As), way)
    is_dry = landed.available_As < 0
    dry_As, home_As = (middle_As, home_As) if is_dry else (dry_As, middle_As)
letter = next(key for key, reason in task.reasons.items() if "Only the available well" in reason)
answer_1 = letter, {"home_As": home_As, "dry_As": dry_As}
### END SOLUTION

# %%
grade = exercises.check("33.1", answer_1, student)
print(grade)
