"""Flight logs, and what fits use of them."""
