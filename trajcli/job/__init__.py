"""The file format: YAML with positions, units, the model, robot sources, limits, schemas."""
