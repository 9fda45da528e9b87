"""Rows as whoever gets them joins them, and plans whose rows keep all limits so."""
