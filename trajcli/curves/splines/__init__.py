"""Curves through waypoints: splines of several rules, and their time allocation. numpy only."""
