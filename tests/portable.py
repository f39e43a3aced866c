"""Runs the tests where machines differ: odd paths, no HOME, another user, older processors.

``make test-portable`` runs all tests in each setting, ``make test-portable TESTS="tests/cli -x"`` a
selection. Settings that this machine does not have are skipped, with the reason.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from numpy._core import _multiarray_umath as numpy_core

ROOT = Path(__file__).parents[1]
BY_PRODUCTS = shutil.ignore_patterns(".*_cache", ".venv*", ".hypothesis", "__pycache__")
OTHER_USER = "nobody"
PROCESSORS = (("AVX2", "X86_V3", "Haswell"), ("SSE only", "X86_V2", "Nehalem"))
"""Older processors: what they are called, NumPy's newest feature on them, kernels of OpenBLAS."""


@dataclass
class Setting:
    """Where the tests run; with a reason where they cannot."""

    name: str
    environment: dict[str, str]
    user: str | None = None
    skipped: str = ""


def settings(places: Path) -> Iterator[Setting]:
    """Every setting, with directories in a place whose name has a space and an accent."""
    here = dict(os.environ)
    scratch = places / "à jeter"
    scratch.mkdir()
    odd = {name: value for name, value in here.items() if name != "HOME"}
    odd |= {"TMPDIR": str(scratch), "TERM": "dumb"}
    name = "a path with a space and an accent, no HOME, TERM=dumb"
    yield Setting(name, odd)
    reason = not_as_another_user(odd)
    if not reason:
        shutil.chown(scratch, OTHER_USER)
    yield Setting(f"the same, as the user {OTHER_USER}", odd, OTHER_USER, reason)

    features = numpy_core.__cpu_features__
    dispatch = [each for each in numpy_core.__cpu_dispatch__ if features[each]]
    for name, newest, kernels in PROCESSORS:
        beyond = dispatch[dispatch.index(newest) + 1 :] if newest in dispatch else dispatch
        older = {"NPY_DISABLE_CPU_FEATURES": " ".join(beyond), "OPENBLAS_CORETYPE": kernels}
        has = features.get(newest, False) and beyond
        reason = "" if has else "this processor is that one, another kind, or older"
        yield Setting(f"a processor with {name}", here | older, None, reason)


def not_as_another_user(environment: dict[str, str]) -> str:
    """Why the tests cannot run as another user here; empty if they can."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        return "only root may become another user"
    command = [sys.executable, "-c", "import numpy, pytest"]
    try:
        subprocess.run(
            command, env=environment, cwd="/", user=OTHER_USER, capture_output=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return f"{OTHER_USER} may not run {sys.executable}"
    return ""


def main(tests: list[str]) -> int:
    """Run the tests in each setting; 1 if they fail in one of them."""
    results: list[str] = []
    with tempfile.TemporaryDirectory(prefix="optuav é ") as directory:
        places = Path(directory)
        places.chmod(0o755)
        checkout = places / "a checkout"
        shutil.copytree(ROOT, checkout, ignore=BY_PRODUCTS)
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests]
        path = os.pathsep.join([str(checkout), *filter(None, [os.environ.get("PYTHONPATH")])])
        for each in settings(places):
            if each.skipped:
                results.append(f"skipped: {each.name} ({each.skipped})")
                continue
            print(f"\nIn {each.name}", flush=True)
            environment = each.environment | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
            done = subprocess.run(
                command, cwd=checkout, env=environment, user=each.user, check=False
            )
            results.append(f"{'FAILED' if done.returncode else 'passed'}: {each.name}")
    print("\n".join(["", *results]))
    return int(any(each.startswith("FAILED") for each in results))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
