"""Search over sequences of stops: their places, order and durations, with proof."""
