"""The command line: says and shows, computes nothing."""

from optuav.cli.app import main

__all__ = ["main"]
