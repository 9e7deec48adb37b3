"""The complete Pareto front of a space, with what proves that it is complete."""
