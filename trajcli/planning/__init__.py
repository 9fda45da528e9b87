"""From a job to a judged plan."""
