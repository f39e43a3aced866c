"""Exercises of the lessons: tasks with numbers of each student's own, and graders with hints.

An exercise has the number of its lesson and its own, as ``"01.2"``. Its numbers follow from the
text that names the student, on any machine; without a name everybody has the same. In four kinds
of exercise the answer is a figure to predict, a problem to declare, multipliers that
prove an optimum or a conflict, or an itinerary to design.

Examples
--------
>>> from optuav import exercises
>>> task = exercises.task("01.1", student="ada")
>>> print(exercises.check("01.1", 60.0, student="ada").verdict)
not correct
"""

from optuav.exercises.course import check, numbers, task
from optuav.exercises.task import Grade, Task

__all__ = ["Grade", "Task", "check", "numbers", "task"]
__dir__ = __all__.copy
