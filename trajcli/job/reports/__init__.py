"""Parts of the report that several of its models share."""
