"""The benchmark set: missions by name, each made from a line of ``missions.toml``."""

from optuav.mission.benchmark.recipes import Recipe, parsed, recipe_of, recipes

__all__ = ["Recipe", "parsed", "recipe_of", "recipes"]
