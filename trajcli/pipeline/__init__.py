"""What the commands do: plan, judge, slow down, write, compare. Sees the whole house."""
