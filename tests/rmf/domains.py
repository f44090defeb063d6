"""The DDS domain of a test run."""

from functools import cache

from hal_fakes.domain import free_domain


@cache
def domain_of_this_run() -> int:
    """The domain that tests of this process share, where one of their own is not needed: one for each worker."""
    return free_domain()
