"""Other formats to problem files: each importer gives plain data, where it stands, and what it left out."""
