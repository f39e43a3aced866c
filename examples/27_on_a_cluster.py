import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # On a cluster
#
# A study of days on one computer is one of an hour on a hundred. Dask hands its parts to workers,
# which may join, leave and fail while it runs. Here the cluster is a scheduler and two workers on
# this computer, each a process of its own, as they would be on computers of their own.
#
# **Before this lesson:** [A sweep over ten parameters](23_sweep_ten_parameters.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - start a scheduler and workers, and have them compute a study;
# - say what a worker has to have, and what it need not have;
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
# The scheduler writes its address into a file. On a network the workers are told the address, as
# in `dask worker tcp://10.0.0.1:8786`.

# %%
scheduler = dask("scheduler", "--host", "127.0.0.1", "--port", "0")
workers = [dask("worker", "--no-nanny", "--nthreads", "1") for _ in range(2)]
until_s = time.monotonic() + 60.0
while not (address_file.exists() and address_file.stat().st_size):
    if scheduler.poll() is not None or time.monotonic() > until_s:
        raise SystemExit("The scheduler did not start: is optuav[cluster] installed?")
    time.sleep(0.05)
address = json.loads(address_file.read_text())["address"]
print("a scheduler with", len(workers), "workers, by", address.partition(":")[0])

# %% [markdown]
# ## A worker fails
#
# After the third part one worker is killed, if another one is left. Parts come back as bytes, and
# the process that asked writes them: workers need no common file system, only the same versions of
# the packages.
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
print(f"{shared.parts} parts; workers killed: {killed} of {len(workers)}")

# %% [markdown]
# What the worker had not finished, the other one has computed.
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
    {path.name: path.read_bytes() for path in each.directory.iterdir()} for each in (shared, alone)
]
print(f"{len(files[0])} files, alike: {files[0] == files[1]}")

# %% [markdown]
# ## The scheduler fails
#
# Without it there is one error, within seconds, and what is finished stays. Nothing is left to do
# in this study, so that the same call needs no scheduler any more.

# %%
stop()
again = optuav.sweep(study("shared"), scheduler=address)
print(f"{again.kept} of {again.parts} parts were there")
found = optuav.open_sweep(again.directory)
folder.cleanup()
longest = found.hover_time_s.max(["limits.deadline_s", "battery.capacity_As"])
for perspective in found.perspective.values:
    print(f"{perspective:10} {longest.sel(perspective=perspective).item():.1f} s at most")

# %%
optuav.plots.swept(found)
