# %% [markdown]
# # A sweep over ten parameters
#
# A grid of ten parameters with ten values each has 10¹⁰ points. A sequence that fills the space
# evenly says what matters with a few thousand. optuav computes a study in parts and keeps them, so
# the study survives whatever ends it.
#
# **Before this lesson:** [What matters most?](20_what_matters_most.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - state a study of many parameters in a file, and run it from Python or the command line;
# - resume a study that was ended, and say why its files are the same as without the end;
# - find out which parameters matter from one sample of all of them;
# - say from the same sample whether it is large enough.

# %%
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

import optuav

STUDY = """
mission = "paper"
scenarios_per_part = 512

[samples]
count = 4096
seed = 1
limits.deadline_s = { low = 600, high = 1800 }
limits.min_soc = { low = 0.0, high = 0.2 }
battery.capacity_As = { percent = 15 }
battery.available_fraction = { percent = 10 }
battery.flow_rate_per_s = { percent = 50 }
body.mass_kg = { percent = 5 }
laser.power_W = { percent = 30 }
laser.attenuation_per_km = { percent = 50 }
link.transmit_power_W = { percent = 30 }
"wind.force_N[0]" = { deviation = 1.0 }
"""
folder = tempfile.TemporaryDirectory()
file = Path(folder.name, "ten.toml")
file.write_text(STUDY)
done = optuav.sweep(file)
optuav.open_sweep(done.directory).load()

# %% [markdown]
# ## Ended and resumed
#
# On the command line this is `optuav sweep ten.toml`. A part is a file that is whole or absent.
# Here the last two are deleted, as if the power had failed before they were written.
#
# **Before you run:** how many of the eight parts does the same call compute, and will a byte
# differ?

# %%
whole = {path.name: path.read_bytes() for path in done.directory.iterdir()}
for path in sorted(done.directory.glob("part-*"))[-2:]:
    path.unlink()
again = optuav.sweep(file)
same = {path.name: path.read_bytes() for path in done.directory.iterdir()} == whole
{"parts": again.parts, "kept": again.kept, "same bytes": same}

# %% [markdown]
# ## What matters
#
# The parameters are independent, so the share of the variance that one of them explains by itself
# is the variance of the means over slices of its range.
#
# **Before you run:** ten parameters vary at once. Name the three that matter most, in order.

# %%
study = optuav.open_sweep(done.directory)
folder.cleanup()
hover_s = study.hover_time_s.fillna(0.0).values
keys = list(study.coords)
SLICES = 16


def profile(key: str) -> np.ndarray:
    """Mean hover time over slices of a parameter's range, each of as many samples."""
    slices = np.array_split(hover_s[np.argsort(study[key].values)], SLICES)
    return np.array([values.mean() for values in slices])


share = pd.Series({key: profile(key).var() / hover_s.var() for key in keys}, name="explains")
share = share.sort_values(ascending=False)
share.round(4).to_frame()

# %%
places = 100.0 * (np.arange(SLICES) + 0.5) / SLICES
optuav.plots.curves(
    [optuav.plots.Line(key, places, profile(key)) for key in share.index[:3]],
    title="Mean hover over the others",
    x_label="place within the range [%]",
    y_label="longest hover Δ [s]",
)

# %% [markdown]
# The charge to keep hardly counts: with `available`, the available well mostly empties first.
#
# Means of slices scatter: means of independent samples by chance, means of this sequence by less. A
# share below what chance would show says nothing.
#
# **Before you run:** 16 slices of 4096 samples. What share of the variance would a parameter
# without any effect seem to explain?

# %%
chance = (SLICES - 1) / (len(hover_s) - 1)
silent = share[share < chance]
chance, silent.index.tolist()

# %% [markdown]
# No effect is shown for the parameters in this list.
#
# ## Is it enough?
#
# The first half of the sequence is a sample of its own. If it says the same, more samples would not
# change much.
#
# **Before you run:** by how much do you expect the two means to differ?

# %%
half = hover_s[: len(hover_s) // 2]
pd.DataFrame(
    {"mean [s]": [hover_s.mean(), half.mean()], "spread [s]": [hover_s.std(), half.std()]},
    index=["all samples", "first half"],
)
