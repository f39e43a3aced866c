"""A mission as arrays: its places, its legs, the routes over them, and the phases of a route."""
