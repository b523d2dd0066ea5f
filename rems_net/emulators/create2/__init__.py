"""An iRobot Create 2 without its metal: Open Interface, wheels, battery, dangers."""
