"""A DDS domain for each run of the tests."""

from functools import cache

from hal_fakes.domain import free_domain


@cache
def domain_of_this_run() -> int:
    """Return the DDS domain of the tests in this process. A single test may choose another domain."""
    return free_domain()
