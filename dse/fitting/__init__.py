"""From measurements to the figures of a problem file: transmission times and execution times, and how sure they are."""
