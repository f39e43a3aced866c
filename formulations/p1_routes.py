"""(P1) over all routes as one programme with a binary choice, in two forms."""

from __future__ import annotations
