"""The explorer: a mission with sliders, in a browser or a notebook."""
