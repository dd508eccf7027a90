"""Longer checks than the tests have time for; each prints what it measured."""
