# %% [markdown]
# # How many drones?
#
# A market place needs a link for four hours without a gap. One drone covers a quarter of the time,
# so four should do. Do they? And would stronger pads save a drone?
#
# **Before this lesson:** [The endless cycle](31_the_endless_cycle.py).
# **Time:** 35 minutes.
#
# **Learning intentions.** After this page you can
#
# - count drones, places to rest and beams by Little's law;
# - say why several devices share drones better than one;
# - say how strong a pad must be for fewer drones, and what the pack says to that;
# - compare an event of some hours with a service that never ends.

# %%
import math

import numpy as np
import pandas as pd

import optuav

relay = optuav.coverage("matrice350")
relay

# %% [markdown]
# ## Little's law
#
# Drones leave one after another, each with the same cycle of $h + T + r$ seconds. To cover all the
# time, one starts every $h$ seconds. The mean number on the way, at work or at rest is the rate of
# starts times the time each takes (Little's law): $(h + T + r)/h$, and a ring needs the next whole
# number.
#
# **Before you run:** the share of one drone is 25.4 %. How many drones cover everything? How many
# of them rest at the same time?

# %%
fleet = relay.fleet()
fleet

# %%
fleet.plot()["fleet.png"]

# %% [markdown]
# A drone that rests occupies a place. The judge flies the whole fleet for four days, from full
# packs, and looks for a dry well, a gap, or a place taken twice:

# %%
fleet.replay(days=4)

# %% [markdown]
# ## More devices
#
# Now the lasers charge only on the roofs, and all hovers are dark. A published rule gives $m$
# devices $m(\lceil R \rceil + 1)$ drones, with $R = (T + r)/h$: a ring for each device.
#
# **Before you run:** $R$ is 4.1 here. How many drones does the rule ask for with ten devices at
# equal distance, and how many are enough?

# %%
dark = optuav.coverage("matrice350", lit_hover=False)
R = (dark.flight_s + dark.rest_s) / dark.hover_s
devices = np.arange(1, 11)
rings = devices * (math.ceil(R) + 1)
shared = [dark.fleet(share=int(m)).drones for m in devices]
optuav.plots.curves(
    [
        optuav.plots.Line("a ring for each device", devices, rings),
        optuav.plots.Line("shared", devices, shared),
    ],
    title="Drones for several devices",
    x_label="devices",
    y_label="drones",
    y_from_zero=True,
)

# %%
{"a ring for each": int(rings[-1]), "shared": shared[-1]}

# %% [markdown]
# A ring rounds up once for each device. A shared fleet rounds up once.
#
# ## Fewer drones, stronger pads
#
# A pad by cable on the roof may be stronger than the laser. With fewer drones each has less time to
# rest.
#
# **Before you run:** five drones need pads of 315 W. What do three need, and does the pack take it?

# %%
pads = {drones: relay.watts(drones=drones) for drones in (3, 4, 5, 6)}
pd.DataFrame(pads.values(), index=pd.Index(pads, name="drones"))

# %% [markdown]
# Each drone that you save needs more extra watts than the one before. With three drones the current
# exceeds what the pack's maker allows. Stronger pads would not help; another pack would.
#
# ## An event
#
# **Before you run:** all packs are full when the event begins. How many drones does an event of two
# hours need? From how many hours on is it the number of the endless ring?

# %%
events = {hours: relay.event(hours) for hours in (1, 2, 4, 8, 24)}
pd.DataFrame(
    [(hours, event.drones, event.least_drones) for hours, event in events.items()],
    columns=["hours", "drones", "least by charge"],
)

# %%
events[2].plot()["event.png"]

# %% [markdown]
# For a short event, full packs replace drones. The last column counts only charge: if both numbers
# are equal, fewer drones that take turns do not suffice even by charge.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("32.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
pads = optuav.coverage(task.mission).watts(drones=task["drones"])
letter = next(key for key, reason in task.reasons.items() if "ever less time" in reason)
answer_1 = letter, pads.power_W
### END SOLUTION

# %%
grade = exercises.check("32.1", answer_1, student)
print(grade)
