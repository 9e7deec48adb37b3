"""Designs as AADL: a whole model of a problem file, or an implementation that extends the model it came from."""
