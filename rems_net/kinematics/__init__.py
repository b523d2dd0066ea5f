"""Kinematics: poses, chains of joints, linkages and wheels.

Frames are right-handed, x ahead, y left, z up; lengths in m, angles in rad; a turn is
positive by the right-hand rule. A rotation's columns are the axes of the frame that it
turns, seen from the outer one.
"""
