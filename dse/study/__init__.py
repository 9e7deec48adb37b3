"""How the answer moves when limits and inputs move: sweeps, margins, uncertain inputs, robust fronts."""
