"""The curves of the paper as numbers: what its figures plot, for any mission."""
