"""Files that a job names beside its robot: recordings, limits of MoveIt."""
