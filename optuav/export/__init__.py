"""Files of a plan's course on Earth, for maps and for ground stations of drones."""
