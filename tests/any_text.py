"""Characters of random texts: all that UTF-8 can write, none of which is half of a pair.

Hypothesis would go through a million of them, once a run, to find out which ones a codec has.
"""

from hypothesis import strategies as st

CHARACTERS = st.characters(exclude_categories=("Cs",))
