"""Fills a template: one HTML file with its styles, scripts and pictures inside, which may load nothing else."""

import base64
import hashlib
import re
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from regrasp.app.report.colours import stylesheet
from regrasp.interfaces.quote import cut, printable

HERE = Path(__file__).parent
FILE = "report.html"  # a report in the folder that it shows
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:N m|N|kg|rad|deg|degrees|px2?|[cm]?m|m?s|Hz)\b)|(?<=\d N) (?=m\b)")
MAX_TEXT = 2000  # characters of one text; a longer one is cut in its middle


def page(template: str, script: str, *, reload: int = 0, **values: Any) -> bytes:
    """The page of a template, such as "run.html", with the script of that file name, in UTF-8.

    It loads itself anew every `reload` s; 0: not.

    Texts in `values` are escaped, control characters and marks of direction among them; `Markup` goes in as it is. The
    page's policy allows its own style and script by their digests, pictures and films inside the page, and no request.
    """
    code = _file(script)
    style = _file("report.css") + stylesheet()
    policy = (
        f"default-src 'none'; script-src '{_digest(code)}'; style-src '{_digest(style)}'; "
        "img-src data:; media-src data:; base-uri 'none'; form-action 'none'"
    )
    made = (
        _environment()
        .get_template(template)
        .render(policy=policy, style=Markup(style), script=Markup(code), reload=reload, **values)
    )
    return made.encode("utf-8", "replace")


@cache
def _environment() -> Environment:
    made = Environment(
        loader=FileSystemLoader(HERE),
        autoescape=True,
        finalize=lambda value: _unbroken(shown_text(value)),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters["seconds"] = seconds
    return made


def seconds(value: float) -> str:
    """Simulated seconds, as a page tells them."""
    return f"{value:.2f} s"


def shown_text(value: Any) -> Any:
    """A text as the page shows it: printable, and not endless. Other values, and markup, stay as they are."""
    if isinstance(value, Markup) or not isinstance(value, str):
        return value
    return cut(printable(value), MAX_TEXT)


def _unbroken(value: Any) -> Any:
    """A text in which no line breaks between a number and its unit."""
    if isinstance(value, Markup) or not isinstance(value, str):
        return value
    return _BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", value)


def plain_texts(value: Any) -> Any:
    """A value of JSON's types for the page's script, each text in it as `shown_text` has it."""
    if isinstance(value, dict):
        return {name: plain_texts(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain_texts(item) for item in value]
    return shown_text(value)


@cache
def _file(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    """Of a style or a script, as a content security policy names it."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
