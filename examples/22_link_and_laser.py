# %% [markdown]
# # Link and laser
#
# Two beams decide where a drone is of use. The radio link to the device must not fail too often,
# which keeps the hover point near. The laser must reach the drone through air, which decides how
# much charge comes back. Both have a formula of one line.
#
# **Before this lesson:** [A first mission](01_first_mission.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - say what an outage is, and compute and simulate its probability over a Rician channel;
# - find the coverage radius, and from it the place of the hover point;
# - predict how much light haze and fog leave, by the law of Beer and Lambert;
# - read the curve of received power, and say what its cap does to a mission.

# %%
import numpy as np
import pandas as pd

import optuav
from optuav.laser.fits import Fits
from optuav.network import vehicle
from optuav.physics import laser, link

Line, Mark = optuav.plots.Line, optuav.plots.Mark
mission = optuav.load("paper")
channel = vehicle.channel(mission)
pd.Series(channel._asdict(), name="channel").to_frame()

# %% [markdown]
# ## Outage
#
# A direct wave and many reflected ones add up at the receiver, and their sum fluctuates. $K$ is the
# power of the direct wave divided by the power of all others, a ratio and not in dB. If the ratio
# of signal to noise falls below a threshold $\gamma_\mathrm{th}$, nothing is understood: an
# *outage*. Its probability grows with the distance $d$, because the mean power falls with
# $d^\beta$.
#
# **Before you run:** at 500 m the outage probability is about 1 %. At twice the distance the signal
# is four times weaker. Is the probability 2 %, 4 %, or something else?

# %%
far_m = np.array([250.0, 500.0, 1000.0, 2000.0])
outages = link.outage_probability(channel, far_m)
pd.Series(100.0 * outages, index=far_m, name="outage by distance in m [%]").round(3).to_frame()

# %% [markdown]
# At twice the distance the link fails nearly always. As long as the direct wave is strong enough by
# itself, only rare fluctuations break the link; once it is too weak, nothing helps.
#
# **Before you run:** with $K = 0$ there is no direct wave (Rayleigh fading). Is the link then
# better or worse at 250 m? And at 1500 m?

# %%
FACTORS = (0.0, 5.0, 20.0)
distances_m = np.linspace(10.0, 1500.0, 300)
lines = [
    Line(
        f"K = {factor:g}",
        distances_m,
        100.0 * link.outage_probability(channel._replace(rice_factor=factor), distances_m),
    )
    for factor in FACTORS
]
optuav.plots.curves(
    lines,
    title="Outage over a Rician channel",
    x_label="distance to the device d [m]",
    y_label="outage probability [%]",
    y_from_zero=True,
)

# %% [markdown]
# ## Simulate it
#
# The formula needs a Marcum function. A simulation needs only what the words above say: draw the
# amplitude as a direct part and a random one, and count how often it is too small.
#
# **Before you run:** how many draws does a probability of 1 % need, to be known within a tenth of
# itself?

# %%
random = np.random.default_rng(1)
draws, K = 200_000, channel.rice_factor
scattered = (random.normal(size=draws) + 1j * random.normal(size=draws)) / np.sqrt(2.0)
amplitude = np.sqrt(K / (K + 1.0)) + scattered / np.sqrt(K + 1.0)
threshold = 10.0 ** (channel.snr_threshold_dB / 10.0)


def simulated(distance_m):
    """Share of the draws that are too weak at a distance."""
    mean_snr = channel.transmit_power_W / channel.noise_power_W
    mean_snr /= distance_m**channel.path_loss_exponent
    return np.mean(mean_snr * np.abs(amplitude) ** 2 < threshold)


near_m = np.array([450.0, 500.0, 550.0, 600.0])
both = pd.DataFrame(
    {
        "simulated [%]": [100.0 * simulated(distance_m) for distance_m in near_m],
        "by the formula [%]": 100.0 * link.outage_probability(channel, near_m),
    },
    index=near_m,
)
both.round(3)

# %% [markdown]
# A share $p$ of $n$ draws has a standard error of $\sqrt{p (1 - p) / n}$: a tenth of 1 % takes some
# ten thousand draws, and here are twenty times as many. The formula takes none.
#
# ## Coverage
#
# The mission allows an outage of $\varepsilon$ = 1 %. The largest distance with no more is the
# coverage radius $d_\mathrm{max}$, and the drone has to hover inside a ball of that radius around
# the device. At the lowest altitude that is a disc, and the hover point $w_U$ is its point on the
# shortest way.

# %%
radius_m = vehicle.coverage_radius_m(mission)
hover_m = np.array(vehicle.hover_point_m(mission))
float(radius_m), hover_m.tolist()

# %%
optuav.plots.mission_map(mission)

# %% [markdown]
# **Before you run:** if $\varepsilon$ were 10 %, would $d_\mathrm{max}$ be ten times as large?

# %%
limits = np.array([0.001, 0.01, 0.1, 0.5])
radii_m = link.coverage_radius(channel, limits)
pd.Series(radii_m, index=100.0 * limits, name="radius by allowed outage in % [m]").to_frame()

# %% [markdown]
# ## Light through air
#
# The law of Beer and Lambert: each kilometre of air lets the same share of the light through, so
# that $\nu = e^{-\alpha d}$. The attenuation $\alpha$ follows from the visibility, the distance at
# which a dark object can still be told from the horizon, and from the wavelength.
#
# **Before you run:** in haze one can see 3 km. What share of the light arrives after 2.5 km? And in
# fog, with a visibility of 400 m?

# %%
weather = {"clear": 10.0, "haze": 3.0, "fog": 0.4}
wavelength_nm = mission.laser.wavelength_nm
alphas = {name: laser.attenuation(wavelength_nm, km) for name, km in weather.items()}
air = pd.DataFrame({"visibility [km]": weather, "attenuation [1/km]": alphas})
air["left after 2500 m [%]"] = 100.0 * laser.transmission(air["attenuation [1/km]"], 2500.0)
air.round(4)

# %%
distances_m = np.linspace(0.0, 3000.0, 301)
lines = [
    Line(name, distances_m, 100.0 * laser.transmission(alpha, distances_m))
    for name, alpha in alphas.items()
]
optuav.plots.curves(
    lines,
    title=f"Light that is left, at {wavelength_nm:g} nm",
    x_label="distance d [m]",
    y_label="share of the light ν [%]",
    y_from_zero=True,
)

# %% [markdown]
# ## Received power
#
# A source turns electric power into light, and a receiver turns light into power, both along
# straight lines: $P_0 = a_1 a_2 \nu P_s + a_2 b_1 \nu + b_2$. It is never below 0, and never above
# what the battery may be charged with, $I_\mathrm{ch} e_\mathrm{nom}$: a stronger source is turned
# down.
#
# **Before you run:** 1000 W go in. How much comes out beside the laser, without the cap of the
# battery? And where does the cap end in haze? Solve $P_0 = I_\mathrm{ch} e_\mathrm{nom}$ for
# $\nu$, and $\nu$ for $d$.

# %%
conversion = Fits.of(mission).conversion
cap_W = mission.battery.charge_current_A * mission.battery.nominal_voltage_V
source_W = mission.laser.power_W
received_W = {
    name: laser.received_power(conversion, source_W, alpha, distances_m, np.inf)
    for name, alpha in alphas.items()
}
lines = [Line(name, distances_m, power_W) for name, power_W in received_W.items()]
lines.append(Line("cap of the battery", distances_m, np.full(len(distances_m), cap_W)))
optuav.plots.curves(
    lines,
    title="Power that the receiver yields",
    x_label="distance d [m]",
    y_label="received power P0 [W]",
    y_from_zero=True,
    marks=[Mark(float(np.linalg.norm(hover_m - mission.laser.position_m)), "hover point")],
)

# %%
light_W = conversion.emitter_slope * source_W + conversion.emitter_offset_W
needed = (cap_W - conversion.receiver_offset_W) / conversion.receiver_slope
reach_m = {name: 1000.0 * np.log(light_W / needed) / alpha for name, alpha in alphas.items()}
pd.Series(reach_m, name="the cap ends at [m]").round(1).to_frame()

# %% [markdown]
# ## What it means for a mission
#
# In clear air more light reaches the drone than the battery takes: the source is turned down, and
# haze takes nothing until the curve falls below the cap.
#
# **Before you run:** from which visibility on does the plan of the mission feel the weather? Does
# it ever lose all of its hover?

# %%
visible_km = np.concatenate([np.linspace(0.3, 3.0, 28), np.linspace(3.25, 12.0, 36)])
longest = {
    perspective: optuav.batch_arrays(
        "paper", {"laser.visibility_km": visible_km}, perspective=perspective
    )["hover_time_s"].ravel()
    for perspective in ("available", "battery")
}
optuav.plots.curves(
    [Line(name, visible_km, hover_s) for name, hover_s in longest.items()],
    title="The longest hover, by the weather",
    x_label="visibility [km]",
    y_label="longest hover Δ [s]",
)

# %% [markdown]
# With a visibility below 5.5 km, the best roof no longer gets the current that the battery takes,
# and the hover shortens. The plan never loses all of its hover: without any light the drone still
# has the charge that it took off with.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("22.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Solve for the share of the light at which the cap is just reached, and then for the visibility.
import numpy as np

from optuav.laser.fits import Fits
from optuav.network import vehicle
from optuav.physics import laser

hazy, conversion = task.mission, Fits.of(task.mission).conversion
far_m = np.linalg.norm(np.subtract(vehicle.hover_point_m(hazy), hazy.laser.position_m))
cap_W = hazy.battery.charge_current_A * hazy.battery.nominal_voltage_V
low_km, high_km = 0.1, 50.0
while high_km - low_km > 1e-6:
    visible_km = 0.5 * (low_km + high_km)
    alpha = laser.attenuation(hazy.laser.wavelength_nm, visible_km)
    power_W = laser.received_power(conversion, hazy.laser.power_W, alpha, far_m, np.inf)
    low_km, high_km = (visible_km, high_km) if power_W < cap_W else (low_km, visible_km)
letter = next(key for key, reason in task.reasons.items() if "cap hides" in reason)
answer_1 = letter, high_km
### END SOLUTION

# %%
grade = exercises.check("22.1", answer_1, student)
print(grade)
