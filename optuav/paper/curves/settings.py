"""What the paper sets for its studies in the text and in captions, and what it leaves to us."""

from __future__ import annotations

DEADLINES_S = (800.0, 1200.0)
"""T_max of Table II and of Figs. 3 to 6 [s]; the figures after them take the second."""

LEAST_SOC = (0.05, 0.10, 0.15)
"""η0 of Fig. 7."""

SPEED_SHARES = (0.95, 1.0, 1.05, 1.1)
"""Rotor speeds of Fig. 7 over the mission's v_max; the paper's are not in its text."""

HOVER_S = 100.0
"""Hover time of Figs. 9 and 10 [s]."""

OPTIMUM_S = 951.0
"""Δ of the optimal solution in Fig. 8 [s]."""

PACK_STEP_AS = 3000.0
"""Step between the packs 36 000 and 39 000 A s that the text on Fig. 8 names [A s]."""
