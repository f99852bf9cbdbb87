"""The 3D views of a run: viser while it flies, Rerun to go through it."""
