"""How Sphinx builds the site: ``make docs`` (CONTRIBUTING.md says what is where)."""

from __future__ import annotations

import json
import os
import re
import sys
from base64 import b64decode, b64encode
from hashlib import sha256
from html import escape, unescape
from io import BytesIO
from os.path import relpath
from pathlib import Path
from typing import Any

from docutils import nodes
from PIL import Image
from pygments.lexers.special import TextLexer

import optuav
from optuav.modelling.writer import Latex, parts_of

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS))
from make_cards import page as cards  # noqa: E402
from make_dark import dark  # noqa: E402
from make_explorer import page as explorer  # noqa: E402
from make_films import page as films  # noqa: E402
from make_lessons import for_notebooks  # noqa: E402
from make_map import page as map_of_mission  # noqa: E402
from make_map import plans as map_of_plans  # noqa: E402

ROOT = DOCS.parent
COPIES = {
    **{
        path: DOCS / "lessons" / path.relative_to(ROOT / "examples")
        for pattern in ("*.py", "data/*.*")
        for path in (ROOT / "examples").glob(pattern)
    },
    ROOT / "CHANGELOG.md": DOCS / "project" / "changelog.md",
    ROOT / "CHANGELOG-DETAIL.md": DOCS / "project" / "changes-in-detail.md",
    ROOT / "CONTRIBUTING.md": DOCS / "project" / "contributing.md",
}
"""Pages that stand elsewhere, and where they go for Sphinx, which reads one folder."""

ORIGINALS = {copy: original for original, copy in COPIES.items()}
MOVED = {
    "10_discrete_relaxed_continuous": "12_discrete_relaxed_continuous",
    "11_convexity_and_a_bad_local_optimum": "10_convexity_and_a_bad_local_optimum",
    "12_which_building_milp": "11_which_building_milp",
}
"""Earlier names of lessons, whose addresses lead to the new ones."""

TABLE = re.compile(r"^\|.* symbol \|.*\n(?:^\|.*\n)+", re.MULTILINE)
BAR = r"\|"
LINK = re.compile(r"\]\(([^)#:\s]+)(?=[#)])")
NAME = re.compile(r'(?:<span class="pre">|<h1>)[^<]+')
BREAK = re.compile(r"((?<=\w)[./](?=[^\W\d])|(?<=[\w)])[_(](?=\w{3}))")
LISTS = ("lessons", "how-to", "understand")
"""Pages that list others, each with its first picture."""
THUMBNAIL_PX = 416, 260
"""Most that the picture of a page in a list measures."""
BARE = ("teaching-slides", "teaching-sheet", "teaching-homework")
"""Pages to project or to print, without menus."""
DRAWN = re.compile(r"^([\w.]+)\(", re.MULTILINE)
TITLE = re.compile(r'\btitle="([^"]+)"')
HELPER = re.compile(r'^def (\w+)\(.*?^    """(.*?)(?:\.$|\.?""")', re.MULTILINE | re.DOTALL)
IMAGE = re.compile(r"(?:<picture><source [^>]*>)?<img\b[^>]*>(?:</picture>)?")
DATA = re.compile(r"(?<=;base64,)[^\"]+")
PNG = re.compile(r"(?<=image/png;base64,)[\w+/=]+")
FILE = re.compile(r'(?<=src=")([^"]+)\.png(?=")')
PICTURE = re.compile(r'(?<=<p>)<img [^>]*src="([^"]+)"[^>]*>')
PARAGRAPH = re.compile(r"<p>(?!<a[^>]*><img)(.*?)</p>", re.DOTALL)
INLINE = re.compile(r'<a class="headerlink".*?</a>|</?(?:a|code|em|span|strong|wbr)\b[^>]*>')
MARK = re.compile(r"<(script|style|svg|math)\b.*?</\1>|<[^>]*>", re.DOTALL)
NUMBER = re.compile(
    r"<(pre|script|style|svg)\b.*?</\1>|\\[(\[].*?\\[)\]]|"
    r"(?<=\d)\s(?:%|\d{3}|A\ss|[kmn]?m(?:/s)?|[mµ]?s|min|h|[kmMG]?[WAVNJgBh]|[km][WA]h|dB)(?!\w)",
    re.DOTALL,
)


texts: dict[str, str] = {}
"""Text of each page that is written."""
turned: set[str] = set()
"""Names of pictures that have one for dark pages."""


def code() -> str:
    """A digest of the packages: lessons run again when either has changed."""
    digest = sha256()
    for package in ("optuav", "formulations"):
        for path in sorted((ROOT / package).rglob("*.*")):
            if path.suffix != ".pyc":
                digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


project = "optuav"
author = "The optuav developers"
release = version = optuav.__version__
copyright = "The optuav developers, MIT licence"

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx_copybutton",
]
exclude_patterns = ["_*", "*.py", "lessons/data"]
templates_path = ["_templates"]
highlight_language = "none"
smartquotes_action = "qe"  # Two hyphens stay, as in --set
toc_object_entries_show_parents = "hide"
default_role = "py:obj"
suppress_warnings = ["config.cache"]  # How a lesson is read has no written form

myst_enable_extensions = ["attrs_inline", "deflist", "dollarmath"]
myst_heading_anchors = 4
nb_merge_streams = True
nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
os.environ["JUPYTER_PATH"] = str(DOCS / "_jupyter")  # A kernel that tells errors alone
nb_execution_mode = "cache"
nb_execution_cache_path = str(DOCS / "_build" / "executed" / code())
nb_execution_raise_on_error = True
nb_execution_timeout = 300

autodoc_typehints = "none"
autosummary_generate = True
autosummary_context = {"explained": ", ".join(optuav.Datasheet.model_fields)}
numpydoc_show_class_members = False

html_theme = "pydata_sphinx_theme"
html_title = "optuav"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_favicon = "_static/favicon.svg"
html_sidebars = {page: [] for page in ("index", "paper", "coming-from", "faq", "gallery", "try")}
html_search_scorer = str(DOCS / "search.js")
html_context = {"default_mode": "auto"}
html_theme_options = {
    "logo": {
        "text": "optuav",
        "image_light": "_static/logo.svg",
        "image_dark": "_static/logo-dark.svg",
        "alt_text": "Logo of optuav",
    },
    "navbar_end": ["theme-switcher"],
    "header_links_before_dropdown": 7,
    "show_prev_next": True,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": {"**": ["page-toc"], "index": []},
}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
copybutton_line_continuation_character = "\\"
mathjax_path = "mathjax/tex-svg.js"
mathjax3_config: dict[
    str, Any
] = {  # Speech would take a worker, which no browser starts from a file
    "options": {
        "enableMenu": False,
        "menuOptions": {"settings": {"speech": False, "braille": False, "enrich": False}},
    },
    "output": {"displayOverflow": "scroll"},
}


def copy_pages() -> None:
    """Bring the copies up to date; what was made of an original or a name that is gone goes too."""
    for original, copy in COPIES.items():
        copy.parent.mkdir(parents=True, exist_ok=True)
        content = original.read_bytes()
        if original.suffix == ".py":
            content = for_notebooks(content.decode()).encode()
        if not copy.exists() or copy.read_bytes() != content:
            copy.write_bytes(content)
    for folder in ("lessons", "project"):
        for path in (DOCS / folder).rglob("*"):
            if path.is_file() and path not in ORIGINALS:
                path.unlink()
    (DOCS / "_build").mkdir(exist_ok=True)
    drawn = {"cards": cards(), "films": films(), "fall": films("falls")}
    drawn |= {"map": map_of_mission(), "plans": map_of_plans()}
    for name, text in drawn.items():
        (DOCS / "_build" / f"{name}.html").write_text(text, "utf-8")
    names = (DOCS / "api.md").read_text("utf-8").split()
    for path in (DOCS / "api").glob("*.rst"):
        if path.stem not in names:
            path.unlink()


def as_page(app: Any, page: str, text: list[str]) -> None:
    """Make links work from where a page is in the site, and symbols in tables formulas."""
    here = next(
        (path for ending in (".md", ".py") if (path := DOCS / f"{page}{ending}").exists()), None
    )
    if here is None:
        return
    origin = ORIGINALS.get(here, here)

    def led(link: re.Match[str]) -> str:
        target = (origin.parent / link[1]).resolve()
        target = COPIES.get(target, target)
        return f"]({Path(relpath(target, here.parent)).as_posix()}"

    text[0] = TABLE.sub(with_formulas, LINK.sub(led, text[0]))


def with_formulas(table: re.Match[str]) -> str:
    """A table whose column of symbols shows them as problems print them."""
    head, *lines = (re.split(r"(?<!\\)\|", line) for line in table[0].splitlines())
    column = head.index(" symbol ")
    for line in lines:
        symbols = line[column].replace(r"\|", "|").strip().split(", ")
        if all(parts_of(symbol) or "|" in symbol for symbol in symbols):
            shown = ", ".join(f"${Latex().symbol(symbol)}$" for symbol in symbols)
            line[column] = f" {shown.replace('|', BAR)} "
    return "".join(f"{'|'.join(line)}\n" for line in (head, *lines))


def describe(app: Any, tree: nodes.document, page: str) -> None:
    """Give the pictures of lessons words for readers who do not see them.

    They are the title or else the first line of the function that draws, and the paragraph above.
    """
    for image in tree.findall(nodes.image):
        cell = image.parent
        while cell is not None and "cell" not in cell.get("classes", []):
            cell = cell.parent
        if cell is None:
            continue
        source = next(cell.findall(nodes.literal_block)).astext()
        words = TITLE.findall(source)[-1:] or [
            alt for name in DRAWN.findall(source)[-1:] if (alt := purpose(name, page))
        ]
        above = cell.parent[: cell.parent.index(cell)][-1:]
        words += [item.astext() for item in above if isinstance(item, nodes.paragraph)]
        alt = ". ".join(
            item.rstrip(".:") for item in words if not item.startswith("Before you run")
        )
        title = next(cell.parent.findall(nodes.title)).astext()
        words = re.sub(r"\s+", " ", alt) or f"Picture of the section {title}"
        image["alt"] = words[0].upper() + words[1:]


def illustrate(app: Any, tree: nodes.document, page: str) -> None:
    """Put the first picture of each page before its line or row in a list of pages."""
    if page not in LISTS or app.builder.name != "html":
        return
    folder = Path(app.outdir) / "_images"
    folder.mkdir(exist_ok=True)
    for item in [*tree.findall(nodes.list_item), *tree.findall(nodes.row)]:
        link = next(item.findall(nodes.reference), None)
        listed = link["refuri"].removesuffix(".html") if link is not None else ""
        picture = first_picture(app, listed) if listed in app.env.found_docs else None
        if picture is None:
            continue
        picture.thumbnail(THUMBNAIL_PX, Image.Resampling.LANCZOS)
        name = f"thumbnail-{Path(listed).name}.png"
        picture.save(folder / name)
        alt = escape(f"A picture of the page {link.astext()}")
        first = next(item.findall(nodes.paragraph))
        shown = f'<img src="_images/{name}" alt="{alt}">'
        shown = f'<a class="thumbnail" href="{link["refuri"]}">{shown}</a>'
        first.parent.insert(0, nodes.raw("", shown, format="html"))


def survey(app: Any, tree: nodes.document, page: str) -> None:
    """Show the gallery at a glance: the first picture of each section, which leads to it."""
    if page != "gallery" or app.builder.name != "html":
        return
    gallery = next(tree.findall(nodes.section))
    sections = [part for part in gallery.children if isinstance(part, nodes.section)]
    shown = []
    for section in sections:
        title = escape(section.next_node(nodes.title).astext())
        picture = app.env.images[section.next_node(nodes.image)["uri"]][1]
        image = f'<img src="_images/{picture}" alt="Picture of the section {title}">'
        shown.append(f'<a class="thumbnail" href="#{section["ids"][0]}">{image}{title}</a>')
    grid = f'<nav class="overview" aria-label="All pictures">{"".join(shown)}</nav>'
    gallery.insert(gallery.index(sections[0]), nodes.raw("", grid, format="html"))


def outdated(app: Any, env: Any, added: Any, changed: Any, removed: Any) -> tuple[str, ...]:
    """Lists of pages are written whenever the site is built: pictures of others may be new."""
    return LISTS


def first_picture(app: Any, page: str) -> Image.Image | None:
    """The first picture of a page, a file or in the HTML of a cell; None without one."""
    for node in app.env.get_doctree(page).findall():
        if isinstance(node, nodes.image) and node["uri"].endswith(".png"):
            return Image.open(Path(app.srcdir) / node["uri"])
        if isinstance(node, nodes.raw) and (data := PNG.search(node.astext())):
            return Image.open(BytesIO(b64decode(data[0])))
    return None


def purpose(called: str, page: str) -> str:
    """The purpose of a function of the package's pictures, of a lesson, or of its helpers."""
    name = called.rpartition(".")[2]
    drawn = getattr(optuav.plots, name, None)
    if drawn:
        return drawn.__doc__.partition("\n")[0].removeprefix("Draw ")
    known = dict[str, str]()
    for path in (
        DOCS / f"{page}.py",
        *sorted((ROOT / "optuav" / "exercises" / "helpers").glob("*.py")),
    ):
        for own, words in HELPER.findall(path.read_text("utf-8")):
            known |= {f"{path.stem}.{own}": words, own: words}
    return known.get(called, known.get(name, "")).removeprefix("Draw ")


def complete_page(
    app: Any, page: str, template: str, context: dict[str, Any], tree: Any
) -> str | None:
    """Link pictures to their files, add those for the dark, and keep the text for excerpts."""
    if "body" not in context:
        return None
    context["metatags"] += described(context, app.config.html_baseurl)
    context["body"] = PICTURE.sub(r'<a href="\1">\g<0></a>', context["body"])
    context["body"] = IMAGE.sub(twins, context["body"])
    words = MARK.sub(" ", INLINE.sub("", context["body"]))
    texts[page] = re.sub(r"\s+", " ", unescape(words)).strip()
    return "bare.html" if page in BARE else None


def described(context: dict[str, Any], site: str) -> str:
    """What a search engine and a link to a page show of it: title, first paragraph, a picture.

    The picture has the whole address if that of the site is known, as few readers of links follow
    another one.
    """
    preview = "_static/preview.png"
    first = PARAGRAPH.search(context["body"])
    words = re.sub(r"\s+", " ", unescape(MARK.sub("", first[1] if first else ""))).strip()
    title = unescape(MARK.sub("", context["title"]))
    shown = {
        "og:title": title,
        "og:description": words,
        "og:image": f"{site.rstrip('/')}/{preview}"
        if site
        else context["pathto"](preview, resource=True),
        "og:type": "website",
    }
    tags = "".join(
        f'<meta property="{name}" content="{escape(text)}">\n' for name, text in shown.items()
    )
    return f'<meta name="description" content="{escape(words)}">\n{tags}'


def twins(image: re.Match[str]) -> str:
    """A picture for light pages, and the same for dark ones."""
    other = DATA.sub(lambda data: b64encode(dark(b64decode(data[0]))).decode(), image[0])
    if file := FILE.search(image[0]):
        turned.add(f"{Path(file[1]).name}.png")
        other = FILE.sub(r"\1-dark.png", image[0])
    if other == image[0]:
        return other
    light = image[0].replace("<img", '<img class="only-light"', 1)
    return light + other.replace("<img", '<img class="only-dark"', 1)


def store_twins(app: Any, failed: Exception | None) -> None:
    """Write the pictures for dark pages beside those for light ones."""
    if failed is None and app.builder.name == "html":
        for name in turned:
            path = Path(app.outdir) / "_images" / name
            path.with_name(f"{path.stem}-dark.png").write_bytes(dark(path.read_bytes()))


def store_texts(app: Any, failed: Exception | None) -> None:
    """Write the texts of all pages for the search, which a page opened as a file cannot fetch."""
    if failed is None and app.builder.name == "html":
        written = f"const texts = {json.dumps(texts, ensure_ascii=False)};\n"
        (Path(app.outdir) / "_static" / "texts.js").write_text(written, "utf-8")


def break_names(app: Any, page: str, template: str, context: dict[str, Any], tree: Any) -> None:
    """Let names break before words after a dot, a bracket or an underscore; units stay whole."""
    if "body" in context:
        body = NAME.sub(lambda name: BREAK.sub(r"\1<wbr>", name[0]), context["body"])
        context["body"] = NUMBER.sub(
            lambda number: (
                number[0] if number[0][0] in "<\\" else re.sub(r"\s", "\u00a0", number[0])
            ),
            body,
        )
        for near in ("prev", "next"):
            if context.get(near):
                title = BREAK.sub(r"\1<wbr>", context[near]["title"])
                context[near] = context[near] | {"title": title}


def skipped(app: Any, what: str, name: str, found: Any, skip: bool, options: Any) -> bool | None:
    """Leave out fields of named tuples, which are explained as parameters of their class."""
    return True if type(found).__name__ == "_tuplegetter" else None


def store_explorer(app: Any, failed: Exception | None) -> None:
    """Write the explorer's page with stored answers beside the pages that show it."""
    if failed is None and app.builder.name == "html":
        (Path(app.outdir) / "explorer.html").write_text(explorer(), "utf-8")


def store_redirects(app: Any, failed: Exception | None) -> None:
    """Write a page at each earlier address of a lesson that leads to the new one."""
    if failed is None and app.builder.name == "html":
        for earlier, name in MOVED.items():
            (Path(app.outdir) / "lessons" / f"{earlier}.html").write_text(
                f'<!doctype html><title>{name}</title><meta http-equiv="refresh" content="0; '
                f'url={name}.html"><p>This lesson is now <a href="{name}.html">{name}</a>.',
                "utf-8",
            )


def setup(app: Any) -> None:
    """Copy pages before Sphinx looks for them."""
    copy_pages()
    app.add_lexer("csv", TextLexer)
    app.connect("source-read", as_page)
    app.connect("env-get-outdated", outdated)
    app.connect("doctree-resolved", describe)
    app.connect("doctree-resolved", illustrate)
    app.connect("doctree-resolved", survey)
    app.connect("html-page-context", complete_page)
    app.connect("html-page-context", break_names)
    app.connect("autodoc-skip-member", skipped)
    app.connect("build-finished", store_explorer)
    app.connect("build-finished", store_redirects)
    app.connect("build-finished", store_twins)
    app.connect("build-finished", store_texts)
