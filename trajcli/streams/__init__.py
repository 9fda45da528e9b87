"""Formats in which samples leave and enter, one file each."""
