import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

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

import optuav
from optuav.mission.flights.rotors import Rotors
from optuav.network import vehicle
from optuav.physics import rotor, six_stages

mission = optuav.load("paper")
if mission.rotor is None:
    raise SystemExit("This mission states no rotor: take one that does, as `paper`.")
motor, airframe = Rotors(mission).motor, Rotors(mission).airframe
way_m = np.subtract(vehicle.hover_point_m(mission), mission.route.origin_m)
leg = six_stages.leg(airframe, motor, tuple(way_m))

# %% [markdown]
# ## The stages from the origin to the hover point
#
# Four rotors run at full speed while the UAV moves. While it turns, one runs at full speed, two at
# $1/\sqrt{2}$ of it, and one stands still. That draws less current.
#
# **Before you run:** the leg is 2.7 km long and takes 38 s. How much of that does the drone turn,
# and how fast does it fly at most?

# %%
print(f"{'stage':<12}{'s':>8}{'A':>9}{'A s':>9}")
for name, duration_s, current_A in zip(
    leg.loads.stages, leg.loads.durations_s, leg.loads.currents_A, strict=True
):
    print(f"{name:<12}{duration_s:8.3f}{current_A:9.3f}{duration_s * current_A:9.1f}")
print(f"{'in all':<12}{leg.loads.duration_s:8.3f}{'':9}{leg.loads.charge_As:9.1f}")
print(f"distance {leg.distance_m:.1f} m, peak speed {leg.peak_speed_m_s:.2f} m/s")
print(f"{sum(leg.turn_times_s):.4f} s of turning")

# %%
optuav.plots.leg(mission, "origin", "hover")

# %% [markdown]
# No small quadrotor flies at 155 m/s: the model has no drag. Where that matters, state
# `flight.max_speed_m_s` with `flight.model = "regimes"`.
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
for name, attitude, acceleration in (
    ("accelerate", leg.accelerate, leg.acceleration_m_s2 * along),
    ("brake", leg.brake, -leg.braking_m_s2 * along),
):
    ψ_p, ψ_r = attitude.pitch_rad, attitude.roll_rad
    f = np.array([math.sin(ψ_p) * math.cos(ψ_r), math.sin(ψ_r), math.cos(ψ_p) * math.cos(ψ_r)])
    tilt = math.degrees(math.acos(f[2]))
    print(
        f"{name}: pitch {math.degrees(ψ_p):.2f}°, roll {math.degrees(ψ_r):.2f}°: {tilt:.2f}° in all"
    )
    print("  thrust and weight", *((thrust_N * f + gravity_N).round(6) + 0.0), "N")
    print("  mass × acceleration", *((airframe.mass_kg * acceleration).round(6) + 0.0), "N")

# %% [markdown]
# ## Wind
#
# A steady wind pushes with a constant force.
#
# **Before you run:** which takes longer, a leg against a wind of 6 N or one with it?

# %%
winds_N = np.linspace(-9.0, 9.0, 7)
windy = six_stages.leg(airframe, motor, tuple(way_m), tuple(winds_N * each for each in along))
for wind_N, duration_s, charge_As in zip(
    winds_N, windy.loads.duration_s, windy.loads.charge_As, strict=True
):
    print(f"wind {wind_N:+5.1f} N along the path: {duration_s:7.3f} s, {charge_As:8.1f} A s")

# %% [markdown]
# The wind helps in one half of the leg and hinders in the other, so head wind and tail wind of the
# same strength take the same time.
#
# The thrust has to balance weight and wind. Above the largest wind no leg is possible: every time
# is NaN, and `impossible` says why.

# %%
limit_N = rotor.largest_wind(motor, airframe.weight_N, tuple(along))
storm_N = tuple(1.001 * limit_N * along)
print(
    f"largest level wind {limit_N:.4f} N; above it,",
    six_stages.impossible(airframe, motor, storm_N),
)

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

from optuav.mission.flights.rotors import Rotors
from optuav.network import vehicle
from optuav.physics import six_stages

airframe, motor = Rotors(task.mission).airframe, Rotors(task.mission).motor
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
