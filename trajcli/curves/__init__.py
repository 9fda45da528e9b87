"""Functions of one variable: the piecewise polynomial and the laws that build one. numpy only."""
