"""Comparison of sample streams: `trajcli diff`."""
