import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # A sweep over ten parameters
#
# A grid of ten parameters with ten values each has 10¹⁰ points. A sequence that fills the space
# evenly says what matters with a few thousand. A study in a file is computed in parts that are
# kept: it survives whatever ends it.
#
# **Before this lesson:** [What matters most?](20_what_matters_most.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - state a study of many parameters in a file, and run it from Python or the command line;
# - go on with a study that was ended, and say why its files are the same as without the end;
# - find out which parameters matter from one sample of all of them;
# - say from the same sample whether it is large enough.

# %%
import tempfile
from pathlib import Path

import numpy as np

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
print(f"{done.scenarios} scenarios in {done.parts} parts")

# %% [markdown]
# ## Ended, and gone on with
#
# On the command line this is `optuav sweep ten.toml`. A part is a file that is whole or absent.
# Here the last two are deleted, as if the power had failed before they were written.
#
# **Before you run:** how many parts does the same call compute, and will a byte differ?

# %%
whole = {path.name: path.read_bytes() for path in done.directory.iterdir()}
for path in sorted(done.directory.glob("part-*"))[-2:]:
    path.unlink()
again = optuav.sweep(file)
print(f"{again.kept} of {again.parts} parts were there")
same = {path.name: path.read_bytes() for path in done.directory.iterdir()} == whole
print("the same bytes:", same)

# %% [markdown]
# ## What matters
#
# The parameters are independent: the share of the variance that one explains by itself is the
# variance of the means over slices of its range.
#
# **Before you run:** ten parameters vary at once below. Name the three that matter most, in order.

# %%
found = optuav.open_sweep(done.directory)
folder.cleanup()
hover_s = found.hover_time_s.fillna(0.0).values
keys = list(found.coords)
SLICES = 16
if not (0 < SLICES <= len(hover_s) and hover_s.any()):
    raise SystemExit("Each slice needs a sample, and one a plan: take more samples, or more time.")


def profile(key: str) -> np.ndarray:
    """Mean hover time over slices of a parameter's range, each of as many samples."""
    slices = np.array_split(hover_s[np.argsort(found[key].values)], SLICES)
    return np.array([each.mean() for each in slices])


share = {key: float(profile(key).var() / hover_s.var()) for key in keys}
most = sorted(share, key=share.__getitem__, reverse=True)
for key in most:
    print(f"{key:28} explains {share[key]:6.1%}")

# %% [markdown]
# The least charge hardly counts: with `available`, the available well mostly empties first.
#
# Means of slices scatter, those of independent samples by chance, those of this sequence by less:
# a share below what chance would show says nothing.
#
# **Before you run:** 16 slices of 4096 samples. What share of the variance would a parameter
# without any effect seem to explain?

# %%
chance = (SLICES - 1) / (len(hover_s) - 1)
silent = [key for key in keys if share[key] < chance]
print(f"by chance some {chance:.1%}: no effect is shown for {', '.join(silent) or 'none'}")
pictured = most[:3]
places = 100.0 * (np.arange(SLICES) + 0.5) / SLICES
lines = [optuav.plots.Line(key, places, profile(key)) for key in pictured]
words = {"x_label": "place within the range [%]", "y_label": "longest hover Δ [s]"}
optuav.plots.curves(lines, title="Mean hover over the others", **words)

# %% [markdown]
# ## Is it enough?
#
# The first half of the sequence is a sample of its own. Where it says the same, more would not
# change much.
#
# **Before you run:** by how much do you expect the two means to differ?

# %%
half = hover_s[: len(hover_s) // 2]
print(f"mean {hover_s.mean():.1f} s, by the first half {half.mean():.1f} s")
print(f"spread {hover_s.std():.1f} s, by the first half {half.std():.1f} s")
