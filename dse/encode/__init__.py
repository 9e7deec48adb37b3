"""The design space as a CP-SAT model."""
