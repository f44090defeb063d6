"""The DDS domain of one run of the tests."""

from functools import cache

from hal_fakes.domain import free_domain


@cache
def domain_of_this_run() -> int:
    """Return the domain of this process's tests. A test may have its own domain instead."""
    return free_domain()
