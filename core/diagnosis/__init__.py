"""From residuals to class probabilities, a verdict and the evidence for it."""
