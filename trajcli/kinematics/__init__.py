"""The robot as numbers. numpy only."""
