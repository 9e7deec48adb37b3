"""Files in and out: the one home of reading (bounded, regular files only) and of writing (guarded, in one step)."""
