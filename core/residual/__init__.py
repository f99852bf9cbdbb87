"""What a fault leaves when the healthy flight is taken away."""
