"""What holds for all tests."""

from hypothesis import settings
from transports import use_transports

use_transports()

pytest_plugins = ["budgets"]

# A machine may be busy: what takes long is told by the budgets, not by one case.
settings.register_profile("patient", parent=settings.default, deadline=None)
settings.load_profile("patient")
