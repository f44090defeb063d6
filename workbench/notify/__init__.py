"""Notices about a site's troubles, sent to people by webhook, mail and ntfy."""
