"""The DDS domain of a test run."""

from functools import cache

from hal_fakes.domain import free_domain


@cache
def domain_of_this_run() -> int:
    """Return the domain that tests of this process share unless a test needs its own."""
    return free_domain()
