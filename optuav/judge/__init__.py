"""An independent judge: a plan simulated again from its mission, and the verdict on it."""

from optuav.judge.audit import Audit, audit
from optuav.judge.replay import Replay, replay
from optuav.judge.solutions import CheckedSolutions, check_solutions
from optuav.judge.timeline import Itinerary, Stop

__all__ = ["Audit", "CheckedSolutions", "Itinerary", "Replay", "Stop"]
__all__ += ["audit", "check_solutions", "replay"]
