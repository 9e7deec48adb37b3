"""Discrete-event simulation of a design: a second witness that shares no formula with `dse.analysis`."""
