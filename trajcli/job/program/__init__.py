"""Programs in job files: repeats, sequences and points that are many, as plain moves."""
