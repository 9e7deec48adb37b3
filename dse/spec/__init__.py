"""The problem file: text to a validated, frozen specification."""
