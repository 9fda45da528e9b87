"""Batches: many jobs planned by processes of this machine or of a cluster."""
