"""Values of the job file as pydantic types: numbers with units, limits, poses, targets, waypoints."""
