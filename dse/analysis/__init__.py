"""What a design amounts to: formulas over designs, and the referee that applies them."""
