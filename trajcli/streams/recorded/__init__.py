"""Recorded motions of anybody: what their columns, units and time stamps say."""
