"""Mystery flights: a hidden fault, the evidence that a learner marks, and what it is worth."""
