"""The public face in Python: plans, arms, judgements of arrays, and files of motions."""
