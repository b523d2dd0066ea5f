"""Cameras' pictures: colours and light of a world, and the renderers."""
