"""Results as people read them: on the terminal, as pages, and as files."""
