"""An independent judge: a plan simulated again from its mission, and the verdict on it."""

from optuav.judge.audit import Audit, audit
from optuav.judge.replay import Replay, replay
from optuav.judge.timeline import Itinerary
from optuav.plan import Stop

__all__ = ["Audit", "Itinerary", "Replay", "Stop", "audit", "replay"]
__dir__ = __all__.copy
