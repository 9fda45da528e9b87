"""Rows of a file: their time stamps, whether they are those of a plan, and joints behind rows of the tool."""
