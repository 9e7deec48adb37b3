"""How text leaves the program on a terminal or in a pipe: what would steer a terminal is shown, never sent.

Names, keys, topics and messages of other libraries come from files that anybody may have written. The commands print by
these functions and the console of `dse.cli.common` alone. Files, also on standard output, have their data as they are.
"""

from __future__ import annotations

import sys

import click

LEAST_COLUMNS = 20
"""No message is set in fewer columns, however narrow the terminal."""
KEPT = "\t\n"
_STEERING = (
    *range(0x20), *range(0x7F, 0xA0),  # C0, DEL, C1
    0x061C, 0x200B, 0x200E, 0x200F, *range(0x2028, 0x202F), *range(0x2060, 0x206A), 0xFEFF,  # directions, invisible
    *range(0xD800, 0xE000),  # halves of characters
    *range(0xE0000, 0xE0080),  # invisible letters
)  # fmt: skip
SHOWN = {code: chr(code).encode("unicode-escape", "surrogatepass").decode() for code in _STEERING} | {0x85: r"\x85"}
SHOWN_IN_TEXT = {code: shown for code, shown in SHOWN.items() if chr(code) not in KEPT}


def visible(text: str) -> str:
    r"""The text with every character that steers a terminal as an escape; line breaks and tabs are kept.

    Examples
    --------
    >>> print(visible("a\x1b[31mb\u202ec\x00"))
    a\x1b[31mb\u202ec\x00
    """
    return text.translate(SHOWN_IN_TEXT)


def in_a_line(text: str) -> str:
    r"""The text as `visible` has it, in one line: line breaks and tabs are shown, too.

    Examples
    --------
    >>> print(in_a_line("a\nb"))
    a\nb
    """
    return text.translate(SHOWN)


def say(text: str) -> None:
    """Print a line on standard output.

    Escape sequences in the text are shown as text.
    """
    click.echo(visible(text))


def tell(text: str) -> None:
    """Print a line on standard error, on a terminal in lines of its width.

    Escape sequences in the text are shown as text. A pipe gets each message in one line.
    """
    shown = visible(text)
    if sys.stderr.isatty():
        import shutil

        width = max(shutil.get_terminal_size().columns, LEAST_COLUMNS)
        shown = "\n".join(_wrapped(line, width) for line in shown.split("\n"))
    click.echo(shown, err=True)


def _wrapped(line: str, width: int) -> str:
    """A line in lines of at most so many columns, further ones indented; words, such as paths, stay whole."""
    if len(line) <= width:
        return line
    import textwrap

    return textwrap.fill(
        line, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False, replace_whitespace=False
    )


def rewrite(text: str) -> None:
    """Write over the last line on a terminal, by standard error.

    For progress: the next call replaces the line.
    """
    click.echo(f"\r\033[K{visible(text)}", err=True, nl=False)
