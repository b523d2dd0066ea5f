"""Testing: check that a robot does what every robot must do, and measure how well.

from rems_net.testing import check_robot

def test_my_cart():
    check_robot("my_cart.py:Cart", "my_cart.py:CartDriver")
"""

from rems_net.testing.check import check_robot, examine
from rems_net.testing.report import Finding, Outcome, Report
from rems_net.testing.subject import Subject

__all__ = ["Finding", "Outcome", "Report", "Subject", "check_robot", "examine"]
