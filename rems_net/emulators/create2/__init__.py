"""An emulated iRobot Create 2: Open Interface, wheels, battery, dangers."""
