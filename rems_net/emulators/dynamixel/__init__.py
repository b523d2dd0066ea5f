"""X430 servos on a bus, by DYNAMIXEL protocol 2.0, without hardware."""
