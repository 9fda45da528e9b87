"""Rules of known consumers of a motion, and its judgement by them."""
