"""Pages in Markdown become HTML, with links to where things are on the site."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
import html
from pathlib import Path
import re

from markdown_it import MarkdownIt
from markdown_it.token import Token
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_by_name, get_lexer_for_filename
from pygments.util import ClassNotFound

from tools.site.places import place, ROOT, Target, way

__all__ = ["Page", "Section", "anchor", "as_page", "read_code", "read_page"]

_FORMATTER = HtmlFormatter(cssclass="pdoc-code codehilite")
_LANGUAGES = {"": "text", "sh": "bash"}


@dataclass(frozen=True)
class Section:
    """What a search finds: a heading, its anchor, and the text below it."""

    title: str
    anchor: str
    text: str


@dataclass
class Page:
    """A page of the site: its title, its HTML, and the files of ours that it leads to."""

    title: str
    body: str = ""
    sections: list[Section] = field(default_factory=list)
    files: set[Path] = field(default_factory=set)


def anchor(heading: str) -> str:
    """Return the anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def read_page(path: Path, names: Mapping[str, Target]) -> Page:
    """Read a page in Markdown, as ``as_page`` does."""
    return as_page(path.read_text(), path, names)


def as_page(text: str, path: Path, names: Mapping[str, Target]) -> Page:
    """Return the page that a text in Markdown is at ``path``.

    Raises SystemExit where it leads to a file that is not there, or not ours.

    ``names`` are public names with where on the site the reference explains them: where a page
    has one in backquotes, it becomes a link.
    """
    markdown = MarkdownIt("commonmark", {"highlight": _highlighted}).enable("table")
    tokens = markdown.parse(text)
    page = Page(path.stem)
    _find_sections(tokens, page)
    for token in tokens:
        if token.children:
            token.children = list(_linked(token.children, path, page, names))
    page.body = markdown.renderer.render(tokens, markdown.options, {})
    return page


def read_code(path: Path) -> Page:
    """Show a file that is no page as it is, with numbers of lines."""
    title = path.relative_to(ROOT).as_posix()
    formatter = HtmlFormatter(cssclass="pdoc-code codehilite", linenos="inline")
    text = path.read_text()
    try:
        lexer = get_lexer_for_filename(path.name)
    except ClassNotFound:
        lexer = get_lexer_by_name("text")
    body = f"<h1>{html.escape(title)}</h1>\n{highlight(text, lexer, formatter)}"
    return Page(title, body)


def _highlighted(code: str, language: str, _: str) -> str:
    lexer = get_lexer_by_name(_LANGUAGES.get(language, language))
    # What begins otherwise would be wrapped in another <pre>.
    return f"<pre>{highlight(code, lexer, HtmlFormatter(nowrap=True))}</pre>".replace(
        "<pre>", '<pre class="pdoc-code codehilite">', 1
    )


def _find_sections(tokens: list[Token], page: Page) -> None:
    """Give each heading an anchor; collect what stands below it."""
    seen: Counter[str] = Counter()
    heading, where, texts = "", "", list[str]()
    for before, token in zip([None, *tokens], tokens, strict=False):
        if token.type != "inline":
            if token.type == "fence":
                texts.append(token.content)
            continue
        if before is None or before.type != "heading_open":
            texts.append(token.content)
            continue
        if heading:
            page.sections.append(Section(heading, where, _words(texts)))
        elif not texts:
            page.title = _plain(token)
        heading, where, texts = _plain(token), anchor(_plain(token)), []
        seen[where] += 1
        if seen[where] > 1:
            where += f"-{seen[where] - 1}"
        before.attrSet("id", where)
    page.sections.append(Section(heading, where, _words(texts)))


def _words(texts: list[str]) -> str:
    """Return what a search shows of texts in Markdown: words, without addresses and signs."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", " ".join(texts))
    return " ".join(re.sub(r"<!--.*?-->|[`*]", "", text).split())


def _plain(token: Token) -> str:
    return "".join(child.content for child in token.children or ())


def _linked(
    tokens: list[Token], path: Path, page: Page, names: Mapping[str, Target]
) -> Iterator[Token]:
    """Yield the tokens of a paragraph, links turned to the site, names turned into links."""
    is_in_link = False
    for token in tokens:
        if token.type in {"link_open", "image"}:
            attribute = "href" if token.type == "link_open" else "src"
            token.attrSet(attribute, _address(str(token.attrGet(attribute)), path, page))
        is_in_link = token.type == "link_open" or (is_in_link and token.type != "link_close")
        name = re.match(r"\w+", token.content)
        if token.type == "code_inline" and not is_in_link and name and name.group() in names:
            end, where = names[name.group()]
            yield Token("link_open", "a", 1, attrs={"href": f"{way(place(path), end)}#{where}"})
            yield token
            yield Token("link_close", "a", -1)
        else:
            yield token


def _address(link: str, path: Path, page: Page) -> str:
    """Return where a link of the page leads on the site."""
    name, mark, where = link.partition("#")
    if re.match(r"\w+:", link) or not name:
        return link
    target = (path.parent / name).resolve()
    if not (target.is_file() and target.is_relative_to(ROOT)):
        raise SystemExit(f"{path.relative_to(ROOT)}: {link} leads to no file of ours")
    page.files.add(target)
    return way(place(path), place(target)) + mark + where
