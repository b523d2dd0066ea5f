"""Robots on DYNAMIXEL servos of the X430 series, by protocol 2.0."""
