"""Linear segments with parabolic blends. numpy only."""
