"""Studies of a mission: comparisons, sensitivities and samples, each as one labelled table."""
