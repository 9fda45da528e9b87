"""Pictures of plans and sample streams."""
