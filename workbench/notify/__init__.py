"""Notices to people about a site's troubles: by webhook, mail and ntfy."""
