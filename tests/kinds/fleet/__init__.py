"""Tests of the core for one robot of a fleet, as stories in virtual time."""
