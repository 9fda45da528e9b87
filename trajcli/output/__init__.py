"""What comes out of a plan: rows, report, explanation."""
