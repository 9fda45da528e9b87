"""Rows of a file beside the plan of a job: samples of it or not, and joints behind rows of the tool."""
