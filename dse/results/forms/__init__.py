"""The forms of what `dse` writes as JSON, one class for each format and each part of it."""
