"""Placing lasers: the best of some candidates for many missions, with a bound."""
