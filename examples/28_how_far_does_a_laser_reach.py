# %% [markdown]
# # How far does a laser reach?
#
# A laser beam is thin when it leaves its telescope and wide when it arrives. Four effects decide
# how much of it a receiver on a drone still gets: diffraction, jitter, turbulence and air. This
# lesson finds out which of them ends the reach.
#
# **Before this lesson:** [Link and laser](22_link_and_laser.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - follow the power of a laser from the plug to the battery, and name the step that loses most;
# - say how far the beam would reach under each of the four effects, and which one limits;
# - distinguish a limit by distance from a limit of the battery;
# - say how far a beam is dangerous to the eye, and why.

# %%
import numpy as np
import pandas as pd

import optuav

Line, Mark = optuav.plots.Line, optuav.plots.Mark
mission = optuav.load("relay-today")
mission.to_frame().set_index("key").filter(like="laser", axis=0)

# %% [markdown]
# ## From the plug to the battery
#
# The mission `relay-today` has parts that somebody has shown: 5 kW of electricity drive a laser on
# the roof of a van. A drone hovers 400 m away and carries a receiver that is half a metre wide.
#
# **Before you run:** the laser draws 5000 W. How many watts arrive in the battery? Which step loses
# the most: the source, the air, the size of the receiver, or its cells?

# %%
budget = optuav.link_budget(mission, "hover")
budget

# %%
budget.plot()

# %% [markdown]
# At 400 m distance hardly matters: the air takes 6 %, and almost no light misses the receiver. The
# two conversions lose most. The source turns 40 % of the electricity into light, and the receiver
# turns 20 % of the light back into electricity.
#
# ## Four ways to lose a beam
#
# - **Diffraction** spreads every beam by an angle of about $\lambda / (\pi w_0)$. A wide telescope
#   makes this angle small.
# - **Jitter** is the error of pointing: the beam misses the receiver by $\sigma d$ on each axis.
# - **Turbulence** bends the light at random. Its blur grows faster than the distance.
# - **Air** absorbs and scatters: it takes the same share of the light on each kilometre.
#
# Each line below adds one effect to the line before.
#
# **Before you run:** the reach of a power is the farthest distance at which it still arrives. By
# diffraction only, 150 W reach beyond 100 km. How far do they reach with all four effects? Which
# effect costs the most kilometres, and which one would you fight first?

# %%
NEEDED_W = 150.0
effects = {
    "diffraction": {},
    "and jitter": {"laser.jitter_rad": mission.laser.jitter_rad},
    "and turbulence": {"laser.turbulence_cn2": mission.laser.turbulence_cn2},
    "and air": {"laser.attenuation_per_km": None, "laser.visibility_km": 10.0},
}
calm = {"laser.jitter_rad": 0.0, "laser.turbulence_cn2": 0.0}
calm |= {"laser.attenuation_per_km": 0.0, "laser.visibility_km": None}
changed, worlds = mission.replace(calm), {}
for name, keys in effects.items():
    worlds[name] = changed = changed.replace(keys)
budgets = {name: optuav.link_budget(world, "hover") for name, world in worlds.items()}
reach_km = {name: budget.reach_m(NEEDED_W) / 1000.0 for name, budget in budgets.items()}
pd.Series(reach_km, name="reach [km]").round(1).to_frame()

# %%
eastwards_m = np.array([1.0, 0.0, 0.0])
distances_km = np.linspace(0.2, 30.0, 60)


def received_W(world: optuav.Mission) -> list[float]:
    """DC power [W] at each distance on a line to the east of the laser."""
    start_m = np.array(world.laser.position_m)
    return [
        optuav.link_budget(world, start_m + 1000.0 * far_km * eastwards_m).dc_W
        for far_km in distances_km
    ]


lines = [Line(name, distances_km, received_W(world)) for name, world in worlds.items()]
lines.append(Line("needed", distances_km, np.full(len(distances_km), NEEDED_W)))
optuav.plots.curves(
    lines,
    title="Power from a laser of 5 kW, one effect after the other",
    x_label="distance [km]",
    y_label="DC power of the receiver [W]",
    y_from_zero=True,
)

# %% [markdown]
# Diffraction is no problem for a telescope of 0.3 m. Jitter leaves a sixth of the reach. Turbulence
# leaves less than half of that sixth, and clear air halves the reach again. No optics can bring
# back light that the air has absorbed.
#
# ## A bigger telescope
#
# **Before you run:** a telescope of 0.6 m spreads the beam by half the angle of one of 0.3 m. Which
# of the two reaches farther through real air? What would you buy?

# %%
apertures_m = np.array([0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6])


def reaches_km(world: optuav.Mission) -> list[float]:
    """Reach of the needed power [km] with each telescope."""
    telescopes = [world.replace({"laser.aperture_m": metres}) for metres in apertures_m.tolist()]
    return [optuav.link_budget(site, "hover").reach_m(NEEDED_W) / 1000.0 for site in telescopes]


by_aperture = {name: reaches_km(world) for name, world in list(worlds.items())[1:]}
optuav.plots.curves(
    [Line(name, apertures_m, km) for name, km in by_aperture.items()],
    title="Reach by the size of the telescope",
    x_label="aperture of the laser [m]",
    y_label=f"reach of {NEEDED_W:g} W [km]",
    y_from_zero=True,
    marks=[Mark(mission.laser.aperture_m, "relay-today")],
)

# %% [markdown]
# Above some 5 cm the telescope hardly matters, because another effect limits. A large one even
# reaches less far: its beam starts nearly as wide as the receiver.
#
# ## More power, until the battery says no
#
# **Before you run:** the hover of `relay-today` lasts for 33 minutes with 5 kW. How long does it
# last with 15 kW? Sketch the curve from 0 to 15 kW.

# %%
powers_W = np.linspace(0.0, 15_000.0, 31)
hover_s = optuav.batch_arrays(mission, {"laser.power_W": powers_W})["hover_time_s"].ravel()
optuav.plots.curves(
    [Line("relay-today", powers_W / 1000.0, hover_s / 60.0)],
    title="Longest hover by the power of the laser",
    x_label="electrical power of the laser [kW]",
    y_label="longest hover Δ [min]",
    y_from_zero=True,
    marks=[Mark(mission.laser.power_W / 1000.0, "relay-today")],
)

# %% [markdown]
# From 7.5 kW on nothing changes. The link budget names the limit:

# %%
strong = mission.replace({"laser.power_W": 15_000})
strong_budget = optuav.link_budget(strong, "hover")
strong_budget.limit

# %% [markdown]
# A stronger laser then buys distance, but no charge: the battery gets its limit up to a farther
# point. Whether the receiver is worth its weight is a question for the page *A relay with parts of
# today* of the documentation.
#
# ## The eye
#
# The exposure limit for an eye is 50 W/m² at 1070 nm, and 1000 W/m² at 1550 nm, where the eye
# absorbs the light before the retina.
#
# **Before you run:** how far away must somebody be to look into the beam safely: 1 km, 10 km, or
# more? Is a wide telescope or a narrow one safer?

# %%
hazards_km = {
    (wavelength_nm, aperture_m): optuav.link_budget(
        mission.replace({"laser.wavelength_nm": wavelength_nm, "laser.aperture_m": aperture_m}),
        "hover",
    ).hazard_distance_m
    / 1000.0
    for wavelength_nm in (1070.0, 1550.0)
    for aperture_m in (0.05, 0.3)
}
pd.Series(hazards_km, name="dangerous up to [km]").round(1).unstack().rename_axis(
    index="wavelength [nm]", columns="aperture [m]"
)

# %% [markdown]
# The danger reaches three to eight times as far as the use: a receiver needs hundreds of watts, an
# eye far less. A limit twenty times as high shortens the distance by less than half, and 1550 nm
# also passes the air better. A narrow telescope spreads the beam sooner, which shortens the
# distance too, but near the laser its beam is stronger: the same light leaves through a smaller
# area. These figures are not a safety assessment.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("28.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# A larger telescope reaches farther, up to some 5 cm: halve an interval below that.
steady = task.mission.replace({"laser.jitter_rad": 1e-6 * task["urad"]})
low_m, high_m = 0.005, 0.06
while high_m / low_m > 1.005:
    aperture_m = (low_m * high_m) ** 0.5
    telescope = steady.replace({"laser.aperture_m": aperture_m})
    is_far = optuav.link_budget(telescope, "hover").reach_m(task["watts"]) >= task["reach_m"]
    low_m, high_m = (low_m, aperture_m) if is_far else (aperture_m, high_m)
answer_1 = high_m
### END SOLUTION

# %%
grade = exercises.check("28.1", answer_1, student)
print(grade)
