import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Link and laser
#
# Two beams decide where a drone is of use. The radio link to the device must not fail too often,
# which keeps the hover point near; the laser must reach the drone through air, which decides how
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

import optuav
from optuav.mission.beams.fits import Fits
from optuav.network import vehicle
from optuav.physics import laser, link

Line, Mark = optuav.plots.Line, optuav.plots.Mark
mission = optuav.load("paper")
channel = vehicle.channel(mission)
print(channel)

# %% [markdown]
# ## Outage
#
# A direct wave and many reflected ones add up at the receiver, and their sum fluctuates. $K$ is the
# power of the direct wave over that of all others, a ratio and not in dB. If the ratio of signal to
# noise falls below a threshold $\gamma_\mathrm{th}$, nothing is understood: an *outage*. Its
# probability grows with the distance $d$, because the mean power falls with $d^\beta$.
#
# **Before you run:** at 500 m the outage probability is about 1 %. At twice the distance the signal
# is four times weaker. Is the probability 2 %, 4 %, or something else?

# %%
for distance_m in (250.0, 500.0, 1000.0, 2000.0):
    print(f"{distance_m:6.0f} m: outage {link.outage_probability(channel, distance_m):.3%}")

# %% [markdown]
# The direct wave makes the difference: as long as it is strong enough alone, only rare fluctuations
# break the link; once it is too weak, the link fails nearly always. With $K = 0$ there is no direct
# wave (Rayleigh fading), and the probability rises slowly from the start.

# %%
FACTORS = (0.0, 5.0, 20.0)
if min(FACTORS) < 0.0:
    raise SystemExit("K is a ratio of two powers: take numbers that are not negative.")
distances_m = np.linspace(10.0, 1500.0, 300)
outage_limit = mission.limits.outage_probability
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
for distance_m in (450.0, 500.0, 550.0, 600.0):
    path_loss = distance_m**channel.path_loss_exponent
    mean_snr = channel.transmit_power_W / channel.noise_power_W / path_loss
    simulated = np.mean(mean_snr * np.abs(amplitude) ** 2 < threshold)
    formula = link.outage_probability(channel, distance_m)
    print(f"{distance_m:.0f} m: simulated {simulated:.3%}, by the formula {formula:.3%}")

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
#
# **Before you run:** if $\varepsilon$ were 10 %, would $d_\mathrm{max}$ be ten times as large?

# %%
radius_m = vehicle.coverage_radius_m(mission)
hover_m = np.array(vehicle.hover_point_m(mission))
if np.isnan(hover_m).any():
    raise SystemExit("The ball ends below the lowest altitude: take more power, or more outage.")
apart_m = float(np.linalg.norm(hover_m - mission.link.device_m))
at_m = ", ".join(f"{each:g}" for each in hover_m)
print(f"d_max = {radius_m:.4f} m; the hover point ({at_m}) is {apart_m:.4f} m away")
limits = np.array([0.001, 0.01, 0.1, 0.5])
for limit, reach_m in zip(limits, link.coverage_radius(channel, limits), strict=True):
    print(f"ε = {limit:.1%}: {reach_m:.1f} m")

# %%
optuav.plots.mission_map(mission)

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
if min(weather.values()) <= 0.0:
    raise SystemExit("A visibility is a distance above zero: through nothing, no law is needed.")
wavelength_nm = mission.laser.wavelength_nm
for name, visibility_km in weather.items():
    alpha = laser.attenuation(wavelength_nm, visibility_km)
    percent = 100.0 * laser.transmission(alpha, 2500.0)
    print(f"{name:6} α = {alpha:7.4f} per km, after two and a half kilometres {percent:.3g} %")

# %%
distances_m = np.linspace(0.0, 3000.0, 301)
lines = [
    Line(
        f"{name}, visibility {visibility_km:g} km",
        distances_m,
        100.0 * laser.transmission(laser.attenuation(wavelength_nm, visibility_km), distances_m),
    )
    for name, visibility_km in weather.items()
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
# A source turns electric power into light and a receiver turns light into power, both along
# straight lines: $P_0 = a_1 a_2 \nu P_s + a_2 b_1 \nu + b_2$. It is never below 0, and never above
# what the battery may be charged with, $I_\mathrm{ch} e_\mathrm{nom}$: a stronger source is turned
# down.
#
# **Before you run:** 1000 W go in. How much comes out beside the laser, without the cap of the
# battery? And where does the cap end in haze? Solve $P_0 = I_\mathrm{ch} e_\mathrm{nom}$ for
# $\nu$, and $\nu$ for $d$.

# %%
conversion = Fits(mission).conversion
cap_W = mission.battery.charge_current_A * mission.battery.nominal_voltage_V
source_W = mission.laser.power_W
received_W = {
    name: laser.received_power(
        conversion, source_W, laser.attenuation(wavelength_nm, visibility_km), distances_m, np.inf
    )
    for name, visibility_km in weather.items()
}
print(f"beside the laser {received_W['clear'][0]:.1f} W of {source_W:g} W; cap {cap_W:.0f} W")
light_W = max(conversion.emitter_slope * source_W + conversion.emitter_offset_W, 1e-9)
needed = (cap_W - conversion.receiver_offset_W) / conversion.receiver_slope / light_W
reach_m = {
    name: -1000.0 * float(np.log(needed)) / laser.attenuation(wavelength_nm, visibility_km)
    for name, visibility_km in weather.items()
}
for name, far_m in reach_m.items():
    reached = f"up to {far_m:.0f} m" if far_m > 0.0 else "nowhere"
    print(f"{name:6} the cap is reached {reached}")
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
longest = {}
for perspective in ("available", "battery"):
    found = optuav.batch_arrays(
        "paper", {"laser.visibility_km": visible_km}, perspective=perspective
    )
    longest[perspective] = found["hover_time_s"].ravel()
    worst_s, best_s = longest[perspective][[0, -1]]
    felt_km = visible_km[longest[perspective] < best_s - 1e-6].max(initial=0.0)
    print(f"{perspective:10} {worst_s:.1f} s in fog, {best_s:.1f} s in clear air", end=", ")
    print(f"shorter up to {felt_km:g} km")
optuav.plots.curves(
    [Line(name, visible_km, hover_s) for name, hover_s in longest.items()],
    title="The longest hover, by the weather",
    x_label="visibility [km]",
    y_label="longest hover Δ [s]",
)

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

from optuav.mission.beams.fits import Fits
from optuav.network import vehicle
from optuav.physics import laser

hazy, conversion = task.mission, Fits(task.mission).conversion
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
