"""Parts of reports: numbers with their units, and what is said of efforts."""
