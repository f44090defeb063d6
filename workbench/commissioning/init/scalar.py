"""Text as a YAML scalar."""

import msgspec

BOOLEANS = ("y", "n", "yes", "no", "on", "off", "true", "false", "null")


def quoted(text: str) -> str:
    """A scalar that YAML reads as this text, also where it looks like a number or boolean."""
    plain = text[:1].isalpha() and text.replace("_", "a").replace("-", "a").isalnum()
    if plain and text.lower() not in BOOLEANS:
        return text
    return msgspec.json.encode(text).decode()
