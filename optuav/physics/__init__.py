"""Physics of the mission as plain functions, which know no model and no mission.

They take floats, NumPy arrays (which broadcast) and symbols of the modelling layer alike, unless
their docstring says floats and arrays. Where an element is impossible, the result is NaN there.
"""
