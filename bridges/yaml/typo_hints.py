"""Gives hints about typing mistakes that PyYAML does not name, such as wrong indents, commas and
invisible spaces.

`reason` rephrases PyYAML's error for a file that is not YAML. Each of the other functions checks one
text.
"""

import re

from yaml import Mark, MarkedYAMLError

_SECOND = "mapping values are not allowed here"
FIXES = {
    "found character '\\t' that cannot start any token": "a tab: YAML indents with spaces",
    _SECOND: ("a second ': ' here: indent the line like its neighbours, or put the text in quotes"),
    "could not find expected ':'": "a key without ': ' after it, or a line indented wrongly",
    "found unexpected end of stream": "the file ends inside a text: its closing quote is missing",
    "but found another document": (
        "a second document ('---') starts here: a file describes one daemon, so split the file"
    ),
    "found duplicate anchor": "an anchor ('&name') whose name is already used",
    "expected <block end>, but found '}'": "a '}' without a '{' before it",
    "expected <block end>, but found ']'": "a ']' without a '[' before it",
    "expected <block end>, but found '<scalar>'": (
        "more text after a text that has ended: put the whole text in one pair of quotes"
    ),
}
FIXES |= {
    f"found character '{c}' that cannot start any token": f"a text that begins with {c} needs quotes"
    for c in "@`%"
}

_OPEN = {"expected ',' or '}'": "{", "expected ',' or ']'": "["}
_INDENT = re.compile(r"expected <block end>, but found '<block (mapping|sequence) start>'")
_ODD = re.compile("[\u00a0\u00ad\u1680\u2000-\u200f\u2028-\u202f\u205f\u2060\u3000\ufeff]")
_GLUED = re.compile(r"\s*(?:- )?([A-Za-z_][\w.-]*):(?=[^\s/:])(.*)")
_VALUE = r"""(?:"[^"]*"|'[^']*'|\{.*\}|\[.*\]|[^\s"'{\[|>#].*?)"""
_ENTRY = re.compile(rf""" *[^\s#'"{{\[-][^#'"{{\[]*: +{_VALUE}(?: +#.*)? *$""")
"""A pattern for a line with a key and its whole value."""
_QUOTED = re.compile(r'[:,\[{] *"[^"\n]*"\w+"')
"""A pattern for double quotes inside a text in double quotes: a closing quote, a word, and a third
quote."""
_CURLY = ("\u201c", "\u201d", "\u201e", "\u2018", "\u2019", "\u201a", "\u00ab", "\u00bb")


def reason(error: MarkedYAMLError, text: str) -> str:
    """Return the reason for PyYAML's error, in one line. If a common typing mistake is the cause, the
    reason says how to correct it."""
    problem, where = str(error.problem), error.problem_mark or error.context_mark
    lines = text.splitlines()
    since = error.context_mark or where
    if where and since and (odd := _odd_in(lines, since.line, where.line)):
        return odd
    if where and since and (glued := _glued_in(lines[since.line : where.line + 1], since.line)):
        return glued
    if where and "but found '?'" in problem and since:
        return (
            f"a key beside the '- ' of line {since.line + 1}: delete that '- ', or indent this line"
        )
    misplaced = _INDENT.search(problem) or _SECOND in problem
    if where and misplaced and _follows_no_key(lines, where):
        return "the line above has no ': ': write a colon and a space after its key"
    if where and misplaced and (outdented := _outdented(lines, where)):
        return outdented
    if where and _INDENT.search(problem):
        return _indent(lines, where, since or where)
    if where and since and _QUOTED.search("\n".join(lines[since.line : where.line + 1])):
        return "double quotes inside double quotes: put the whole text in single quotes"
    for expected, bracket in _OPEN.items():
        if problem.startswith(expected) and since:
            return (
                f"a ',' is missing here, or the '{bracket}' of line {since.line + 1} is not closed"
            )
    for usual, fix in FIXES.items():
        if usual in (problem, (error.context or "").partition(" '")[0]):
            return fix
    context = f" ({error.context}, from line {since.line + 1})" if since and error.context else ""
    return f"not YAML: {problem}{context}"


def _odd_in(lines: list[str], first: int, last: int) -> str:
    """Describe the first unusual space in these lines; "" if there is none."""
    for number, line in enumerate(lines[first : last + 1], first + 1):
        if found := _ODD.search(line.partition(" #")[0]):
            where = f"line {number}, column {found.start() + 1}"
            return f"{named(found[0])} on {where}: write an ordinary space"
    return ""


def _glued_in(lines: list[str], first: int) -> str:
    """Describe the first key without a space after its colon; "" if there is none."""
    for number, line in enumerate(lines, first + 1):
        if found := _GLUED.match(line.partition(" #")[0].rstrip()):
            return f"no space after the colon on line {number}: write {found[1]}: {found[2]}"
    return ""


def _indent(lines: list[str], where: Mark, since: Mark) -> str:
    first: dict[int, int] = {}
    for number, line in enumerate(lines[since.line : where.line], since.line + 1):
        if line.strip(" ") and not _is_comment(line):
            first.setdefault(_spaces(line), number)
    above = " or ".join(f"{spaces} (line {first[spaces]})" for spaces in sorted(first))
    return (
        f"wrong indent: {_spaces(lines[where.line])} spaces before this line, {above} before the"
        " lines above: keys of one section have the same indent"
    )


def _outdented(lines: list[str], where: Mark) -> str:
    """Describe a deeper line below a line with a key and its whole value, if an earlier line has the
    deeper line's indent. One of the two lines is indented wrongly. Return "" for other lines."""
    above, here = _above(lines, where.line), _spaces(lines[where.line])
    if above is None or not _ENTRY.match(lines[above]) or _spaces(lines[above]) >= here:
        return ""
    before = above
    while (found := _above(lines, before)) is not None:
        if _spaces(lines[found]) == here:
            return (
                f"line {above + 1} has its value already, so nothing can stand below it: indent line"
                f" {above + 1} by {here} spaces like line {found + 1}, or this line by"
                f" {_spaces(lines[above])} like line {above + 1}"
            )
        if _spaces(lines[found]) < _spaces(lines[above]):
            return ""
        before = found
    return ""


def _above(lines: list[str], number: int) -> int | None:
    """Return the number of the last line above that is neither empty nor a comment. Return None if
    there is none. Numbers begin at 0."""
    kept = (n for n in reversed(range(number)) if lines[n].strip() and not _is_comment(lines[n]))
    return next(kept, None)


def _is_comment(line: str) -> bool:
    return line.lstrip(" ").startswith("#")


def _spaces(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _follows_no_key(lines: list[str], where: Mark) -> bool:
    """Return whether the line above has the same indent, but no key."""
    above = _above(lines, where.line)
    if above is None or _spaces(lines[above]) != _spaces(lines[where.line]):
        return False
    return ": " not in f"{lines[above]} "


def named(character: str) -> str:
    """Return the name of an invisible character, such as `a no-break space (U+00A0)`."""
    import unicodedata  # 0.3 MB, which only a wrong file needs

    name = unicodedata.name(character, "character that cannot be seen").lower()
    article = "an" if name[0] in "aeiou" else "a"
    return f"{article} {name} (U+{ord(character):04X})"


def odd_space(text: str) -> str:
    """Describe an unusual space or quotation mark in a text without quotes; "" if there is none."""
    if found := _ODD.search(text):
        return f"{named(found[0])}: write an ordinary space, or put the text in quotes to keep it"
    if text.startswith(_CURLY):
        return f"YAML does not read {text[0]} as a quote: write \" or '"
    return ""


def cleaned(text: str) -> str:
    """Return the text with ordinary spaces in place of unusual spaces. Remove unusual spaces between
    digits, and quotation marks at the ends of the text."""
    joined = re.sub(f"(?<=[0-9]){_ODD.pattern}(?=[0-9])", "", text)
    return _ODD.sub(" ", joined).strip("".join((" ", *_CURLY)))


def number_meant(text: str, whole: bool) -> str:
    """Return the spelling that YAML requires for a number that is written for people, such as `1,000`.
    Return "" if the text is no number."""
    import unicodedata

    digits = "".join(str(unicodedata.digit(c, c)) for c in text)
    plain = re.sub(r"(?<=\d)['\u2019 ](?=\d{3}(\D|$))", "", digits)
    grouped = re.fullmatch(r"[-+]?\d{1,3}([.,]\d{3})+", plain)
    if grouped and (whole or plain.count(",") > 1):
        return re.sub(r"[.,]", "", plain)
    if re.fullmatch(r"[-+]?\d+,\d+", plain):
        return plain.replace(",", ".") + (f", or {plain.replace(',', '')}" if grouped else "")
    return plain if plain != text and re.fullmatch(r"[-+]?\d+(\.\d+)?", plain) else ""


def has_unit(text: str) -> bool:
    """Return whether the text is a number with its unit, such as `10 s`, `10ms` or `80%`."""
    return bool(re.fullmatch(r"[-+]?\d+([.,]\d+)? ?[A-Za-z%\u00b0\u00b5\u03a9/]+", text))
