# %% [markdown]
# # One leg, six stages
#
# How does a quadrotor get from one place to another if it always uses its full thrust? It turns,
# speeds up, turns over, brakes, turns level, and hovers.
#
# **Before this lesson:** [A first mission](01_first_mission.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - name the six stages of a leg, and say which of them cost time and which cost charge;
# - check the balance of forces that fixes acceleration and attitude;
# - say what wind does to a leg, and at which wind no leg is possible.

# %%
import math

import numpy as np
import pandas as pd

import optuav
from optuav.flight.rotors import Rotors
from optuav.network import vehicle
from optuav.physics import rotor, six_stages

mission = optuav.load("paper")
motor, airframe = Rotors.of(mission).motor, Rotors.of(mission).airframe
way_m = np.subtract(vehicle.hover_point_m(mission), mission.route.origin_m)
leg = six_stages.leg(airframe, motor, tuple(way_m))

# %% [markdown]
# ## The stages from the origin to the hover point
#
# Four rotors run at full speed while the UAV moves. While it turns, one runs at full speed, two at
# $1/\sqrt{2}$ of it, and one stands still. That draws less current.
#
# **Before you run:** the leg is 2.7 km long and takes 38 s. For how much of that time does the
# drone turn, and how fast does it fly at most?

# %%
stages = pd.DataFrame(
    {"duration [s]": leg.loads.durations_s, "current [A]": leg.loads.currents_A},
    index=leg.loads.stages,
)
stages["charge [A s]"] = stages["duration [s]"] * stages["current [A]"]
stages

# %%
optuav.plots.leg(mission, "origin", "hover")

# %% [markdown]
# Turning takes 3 s of the 38 s. No small quadrotor flies at 155 m/s: the model has no drag. Where
# that matters, state `flight.max_speed_m_s` with `flight.model = "regimes"`, or a model with drag,
# as in [How fast to fly?](29_how_fast_to_fly.py).
#
# ## The balance of forces
#
# Full thrust F points along f. Together with gravity it must equal mass times acceleration, along
# the path. The attitude follows: nose down to speed up, nose up to brake.
#
# **Before you run:** full thrust is 17.2 N and the weight 12.7 N. How far must the thrust be tilted
# so that its vertical part just carries the weight?

# %%
thrust_N = rotor.full_thrust(motor)
gravity_N = np.array(airframe.external_force_N((0.0, 0.0, 0.0)))
along = way_m / leg.distance_m


def direction(attitude):
    """Unit vector of the thrust, by pitch and roll."""
    ψ_p, ψ_r = attitude.pitch_rad, attitude.roll_rad
    return np.array([math.sin(ψ_p) * math.cos(ψ_r), math.sin(ψ_r), math.cos(ψ_p) * math.cos(ψ_r)])


thrusts_N = {
    "accelerate": thrust_N * direction(leg.accelerate),
    "brake": thrust_N * direction(leg.brake),
}
accelerations_m_s2 = {
    "accelerate": leg.acceleration_m_s2 * along,
    "brake": -leg.braking_m_s2 * along,
}
tilts_deg = {name: math.degrees(math.acos(F[2] / thrust_N)) for name, F in thrusts_N.items()}
pd.Series(tilts_deg, name="tilt of the thrust [°]").to_frame()

# %% [markdown]
# Both sides of the balance, in newtons along east, north and up:

# %%
sides_N = {
    (name, side): force_N.round(6) + 0.0
    for name in thrusts_N
    for side, force_N in {
        "thrust and weight": thrusts_N[name] + gravity_N,
        "mass × acceleration": airframe.mass_kg * accelerations_m_s2[name],
    }.items()
}
pd.DataFrame(sides_N, index=["east", "north", "up"]).T

# %% [markdown]
# ## Wind
#
# A steady wind pushes with a constant force.
#
# **Before you run:** which takes longer, a leg against a wind of 6 N or one with it?

# %%
winds_N = np.linspace(-9.0, 9.0, 181)
windy = six_stages.leg(airframe, motor, tuple(way_m), tuple(winds_N * share for share in along))
optuav.plots.curves(
    [optuav.plots.Line("origin → hover", winds_N, windy.loads.duration_s)],
    title="Time of the leg by the wind along it",
    x_label="force of the wind along the path [N]",
    y_label="time of the leg [s]",
)

# %% [markdown]
# The wind helps in one half of the leg and hinders in the other, so head wind and tail wind of the
# same strength take the same time.
#
# The thrust has to balance weight and wind. Above the largest wind no leg is possible: every time
# is NaN, and `impossible` says why.
#
# **Before you run:** full thrust is 17.2 N and the weight 12.7 N. What is the largest level wind?

# %%
limit_N = rotor.largest_wind(motor, airframe.weight_N, tuple(along))
storm_N = tuple(1.001 * limit_N * along)
float(limit_N), six_stages.impossible(airframe, motor, storm_N)

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("21.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# As above, with the mass of the task; halve the interval of winds.
import numpy as np

from optuav.flight.rotors import Rotors
from optuav.network import vehicle
from optuav.physics import six_stages

airframe, motor = Rotors.of(task.mission).airframe, Rotors.of(task.mission).motor
way_m = np.subtract(vehicle.hover_point_m(task.mission), task.mission.route.origin_m)
along = way_m / np.linalg.norm(way_m)


def duration_s(wind_N):
    """Time of the leg in a wind along it [s]."""
    wind = tuple(wind_N * along)
    return float(six_stages.leg(airframe, motor, tuple(way_m), wind).loads.duration_s)


low_N, high_N = 0.0, 20.0
while high_N - low_N > 1e-6:
    wind_N = 0.5 * (low_N + high_N)
    is_weak = duration_s(wind_N) < duration_s(0.0) * (1 + task["percent"] / 100)
    low_N, high_N = (wind_N, high_N) if is_weak else (low_N, wind_N)
letter = next(key for key, reason in task.reasons.items() if "helps one half" in reason)
answer_1 = letter, low_N
### END SOLUTION

# %%
grade = exercises.check("21.1", answer_1, student)
print(grade)
