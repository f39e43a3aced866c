"""Search over sequences of stops: which places in which order, how long at each, with proof."""
