"""An independent judge: a plan simulated again from its mission."""
