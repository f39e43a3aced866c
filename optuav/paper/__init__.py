"""The publication: its tables and figures for any mission, and its numbers beside ours."""
