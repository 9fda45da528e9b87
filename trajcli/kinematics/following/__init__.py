"""Joint curves along tool paths: continuation of a branch, exact values, fit within a tolerance."""
