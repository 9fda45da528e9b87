"""Output of a plan: rows, report, explanation."""
