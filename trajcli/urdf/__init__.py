"""Unified Robot Description Format."""
