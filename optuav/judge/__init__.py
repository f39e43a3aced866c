"""An independent judge: a plan simulated again from its mission, and the verdict."""

from optuav.judge.audit import Audit, audit
from optuav.judge.itinerary import Itinerary, Stop
from optuav.judge.replay import Replay, replay

__all__ = ["Audit", "Itinerary", "Replay", "Stop", "audit", "replay"]
