"""Planning of whole jobs: poses resolved, moves planned, retimed and judged."""
