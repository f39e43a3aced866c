# %% [markdown]
# # On a cluster
#
# A study of days on one computer is a study of an hour on a hundred. Dask hands its parts to
# workers, which may join, leave and fail while it runs. Here the cluster is a scheduler and two
# workers on this computer, each a process of its own, as they would be on computers of their own.
# Dask comes with `python -m pip install "optuav[cluster]"`.
#
# **Before this lesson:** [A sweep over ten parameters](23_sweep_ten_parameters.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - start a scheduler and workers, and have them compute a study;
# - say what a worker needs, and what it does not need;
# - say what is lost when a worker fails, and when the scheduler does;
# - check that a cluster computes what one process computes.

# %%
import atexit
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import optuav

folder = tempfile.TemporaryDirectory()
here = Path(folder.name)
address_file = here / "cluster.json"
running: list[subprocess.Popen[bytes]] = []
STUDY = """
output = "{output}"
perspective = ["battery", "available"]
scenarios_per_part = 1000
grid.limits.deadline_s = {{ low = 600, high = 1800, count = 121 }}
grid.battery.capacity_As = {{ low = 30_000, high = 42_000, count = 121 }}
"""


def study(output: str) -> Path:
    """The study with a directory for its parts."""
    file = here / f"{output}.toml"
    file.write_text(STUDY.format(output=output))
    return file


def dask(*words: str) -> subprocess.Popen[bytes]:
    """A process of Dask: on a shell, `dask scheduler …` or `dask worker …`."""
    start = [sys.executable, "-m", f"distributed.cli.dask_{words[0]}", *words[1:]]
    start += ["--scheduler-file", str(address_file), "--no-dashboard"]
    process = subprocess.Popen(start, cwd=here, stderr=subprocess.DEVNULL)
    running.append(process)
    return process


@atexit.register
def stop() -> None:
    """End all processes of the cluster, also where the lesson is ended before its own end."""
    while running:
        process = running.pop()
        process.kill()
        process.wait(timeout=30)


# %% [markdown]
# ## A scheduler and two workers
#
# The scheduler writes its address into a file. On a network you tell the workers the address, as in
# `dask worker tcp://10.0.0.1:8786`.

# %%
scheduler = dask("scheduler", "--host", "127.0.0.1", "--port", "0")
workers = [dask("worker", "--no-nanny", "--nthreads", "1") for _ in range(2)]
while scheduler.poll() is None and not (address_file.exists() and address_file.stat().st_size):
    time.sleep(0.05)
address = json.loads(address_file.read_text())["address"]
address.partition(":")[0], len(workers)

# %% [markdown]
# ## A worker fails
#
# After the third part one worker is killed, if another worker is left. Parts come back as bytes,
# and the process that asked writes them: workers need no common file system, only the same versions
# of the packages.
#
# **Before you run:** what is lost with the worker?

# %%
seen = []


def look(done: int, total: int | None, words: str) -> None:
    """See a part come in; kill a worker after the third, unless it is the last one."""
    seen.append(done)
    if len(seen) == 4 and len(workers) > 1:
        workers[0].kill()
        workers[0].wait(timeout=30)


try:
    shared = optuav.sweep(study("shared"), scheduler=address, progress=look)
except BaseException:  # Interrupted as well: no process stays behind
    stop()
    raise
killed = sum(worker.poll() is not None for worker in workers)
{"parts": shared.parts, "workers": len(workers), "killed": killed}

# %% [markdown]
# Nothing but time: the other worker has computed what the first had not finished.
#
# ## The same bytes
#
# One process computes the study once more: on processors of one type no byte of any file differs.
#
# **Before you run:** the parts came back in another order, and one worker died. How can the files
# be the same?

# %%
alone = optuav.sweep(study("alone"))
files = [
    {path.name: path.read_bytes() for path in run.directory.iterdir()} for run in (shared, alone)
]
{"files": len(files[0]), "alike": files[0] == files[1]}

# %% [markdown]
# Each part depends only on its number, not on who computed it or when.
#
# ## The scheduler fails
#
# Without the scheduler there is one error, within seconds, and what is finished stays. This study
# is finished, so the same call no longer needs a scheduler.

# %%
stop()
again = optuav.sweep(study("shared"), scheduler=address)
{"parts": again.parts, "kept": again.kept}

# %%
results = optuav.open_sweep(again.directory).load()
folder.cleanup()
results

# %%
optuav.plots.swept(results)
