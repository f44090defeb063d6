"""The DDS domain of a test run."""

from functools import cache

from hal_fakes.domain import free_domain


@cache
def domain_of_this_run() -> int:
    """The domain that tests of this process share, unless they need one of their own."""
    return free_domain()
