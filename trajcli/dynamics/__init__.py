"""Dynamics of serial robots: efforts of the joints from a motion. numpy only."""
