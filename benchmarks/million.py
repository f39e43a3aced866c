"""Plans over roofs without walls, 10² to 10⁶ of them: time and memory of a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys

from benchmarks.timing import Row

CODE = """
import json, sys, time, optuav
from benchmarks.towns import town
optuav.solve("paper", "P3")
known = [time.process_time()]
def lap(): known.append(time.process_time())
mission = town(int(sys.argv[1]), None, 200.0); lap()
plan = optuav.solve(mission); lap()
mission.replace({"limits.deadline_s": 900}); lap()
# Of this process: what `resource` says includes the one that started it.
status = dict(line.split(":") for line in open("/proc/self/status"))
peak_MB = int(status["VmHWM"].split()[0]) / 1024
print(json.dumps([b - a for a, b in zip(known, known[1:])] + [peak_MB]))
"""


def run() -> list[Row]:
    """The mission made of columns and its plan, by size; a million within 4 s and 1 GB."""
    rows = list[Row]()
    for power in range(2, 7):
        done = subprocess.run(
            [sys.executable, "-c", CODE, str(10**power)], capture_output=True, text=True, check=True
        )
        made_s, solved_s, replaced_s, peak_MB = json.loads(done.stdout)
        last = 1.0 if power == 6 else None
        what = (
            f"10^{power}: mission {made_s:.2f} s, plan {solved_s:.2f} s, new key {replaced_s:.3f} s"
        )
        rows.append(Row(f"{what} / 4 s", made_s + solved_s, 4.0, at_most=last))
        rows.append(Row(f"10^{power}: memory / 1 GB", peak_MB, 1000.0, at_most=last, unit="MB"))
    return rows
