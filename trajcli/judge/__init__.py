"""Judgement of recorded motions: anybody's rows as the curve their consumer makes of them, against limits."""
