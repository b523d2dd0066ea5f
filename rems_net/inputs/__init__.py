"""Inputs that come with rems_net."""
