"""Editing of recorded motions: retimed, resampled, joined, reversed, cut and converted."""
