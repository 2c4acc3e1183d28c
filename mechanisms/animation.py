"""One design as a web page of its own, moving."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from mechanisms.player import SCRIPT, STYLE, embedded, player_data
from mechanisms.plots import caption

if TYPE_CHECKING:
    from mechanisms.designs import Design
    from mechanisms.task import Task

__all__ = ["animation_page", "page", "player"]


def animation_page(design: Design, task: Task | None = None, driven: str = "") -> str:
    """A page on which the design moves through its poses; it loads nothing from elsewhere."""
    first, _, title = caption(design).partition("\n")
    head = f'<h1>{escape(title or design.id)}</h1><p class="faint">{escape(first)}</p>'
    body = f'{head}<div class="card single">{player(design, task, driven, auto=True)}</div>'
    return page(title or design.id, body)


def player(design: Design, task: Task | None = None, driven: str = "", auto: bool = False) -> str:
    """The element that the script turns into a moving drawing."""
    data = embedded(player_data(design, task, driven))
    begin = f'<div class="player" data-auto="{"yes" if auto else "no"}">'
    return f'{begin}<script type="application/json">{data}</script></div>'


def page(title: str, body: str) -> str:
    """A whole page round `body`, which is HTML already."""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # the page is complete: whatever a task may smuggle in, nothing can be fetched
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        "style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n"
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n<script>{SCRIPT}</script>\n</body>\n</html>\n"
    )
