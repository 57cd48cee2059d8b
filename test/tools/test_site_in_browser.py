"""The site in a browser, opened from its files: menu and search, also on a telephone."""

from chromium import find_chromium, REMEDY, Tab
import pytest

from tools.site.places import ROOT
from tools.site.write_site import write_site

pytestmark = pytest.mark.skipif(find_chromium() is None, reason=REMEDY)

WIDTHS = [390, 769, 1280]
"""Pixels: a telephone, the widest screen on which pdoc folds the menu, a desk."""
BUTTON = "document.getElementById('navtoggle')"
FOUND = "[...document.querySelectorAll('#found li')]"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The pages and definitions as `make docs` writes them, without the reference of modules."""
    folder = tmp_path_factory.mktemp("site")
    assert write_site(folder, {}) == []
    return folder


@pytest.fixture(scope="module", params=WIDTHS)
def tab(request):
    """A tab of that width."""
    tab = Tab(request.param, 844)
    tab.width = request.param
    yield tab
    tab.close()


def is_shown(tab, element):
    """Tell whether one sees an element, in the middle of what is on the screen of it."""
    return tab.value(f"""(() => {{
      const element = {element};
      element.scrollIntoView({{block: "center", behavior: "instant"}});
      const {{left, top, width, height}} = element.getBoundingClientRect();
      const there = document.elementFromPoint(left + width / 2, top + height / 2);
      return left >= 0 && left + width <= innerWidth && element.contains(there);
    }})()""")


def open_page(tab, path):
    """Open a page, and its menu where that is folded."""
    tab.open(path.as_uri())
    tab.wait_for(f"location.href === '{path.as_uri()}' && document.readyState === 'complete'")
    if tab.width <= 769:
        assert not is_shown(tab, "document.querySelector('nav h2')")
        assert is_shown(tab, BUTTON)
        tab.value(f"{BUTTON}.click()")


def search(tab, words):
    """Type words into the search, and return the results' texts."""
    tab.value(f"""(() => {{
      const input = document.getElementById("search");
      input.value = {words!r};
      input.dispatchEvent(new InputEvent("input", {{bubbles: true}}));
    }})()""")
    return tab.value(f"{FOUND}.map((item) => item.innerText)")


def test_the_menu_is_there_and_leads_to_pages_and_sections(tab, site):
    """Before and while something is searched for; a section of the page is not covered by it."""
    open_page(tab, site / "planning.html")
    for title in ("Conventions", "Messages, services and actions", "Paths"):
        link = f"[...document.querySelectorAll('nav a')].find((a) => a.textContent === '{title}')"
        assert is_shown(tab, link), title
    search(tab, "free")
    assert is_shown(tab, "[...document.querySelectorAll('nav a')].at(-1)")
    search(tab, "")
    tab.value("[...document.querySelectorAll('nav a')].find((a) => a.hash === '#paths').click()")
    tab.wait_for("location.hash === '#paths'")
    assert is_shown(tab, "document.getElementById('paths')")
    assert tab.problems == []


@pytest.mark.parametrize("name", ["PointContact", "PlanPath", "GrowRegion"])
def test_a_message_a_service_and_an_action_are_found(tab, site, name):
    """By its name, first of all; its page has the definition with its comments."""
    open_page(tab, site / "index.html")
    first = search(tab, name)[0]
    assert first.startswith(name)
    assert is_shown(tab, f"{FOUND}[0].querySelector('a')")
    tab.value(f"{FOUND}[0].querySelector('a').click()")
    tab.wait_for(f"document.readyState === 'complete' && document.title === '{name}'")
    (file,) = (ROOT / "scene_graph_msgs").glob(f"*/{name}.*")
    assert tab.value("document.querySelector('pre').innerText").strip() == file.read_text().strip()
    # Types of ours lead to their definitions.
    assert tab.value("[...document.querySelectorAll('pre a')].every((a) => a.textContent)")
    assert tab.problems == []


def test_results_show_what_stands_around_the_words(tab, site):
    """The words are marked; signs of patterns are signs, and where nothing is found it says so."""
    open_page(tab, site / "index.html")
    for text in search(tab, "padding carry"):
        assert "padding" in text.lower() or "carry" in text.lower()
    marked = tab.value(f"{FOUND}.map((item) => [...item.querySelectorAll('mark')].length)")
    assert all(marked)
    assert is_shown(tab, f"{FOUND}[0].querySelector('p')")
    assert search(tab, "~/plan_path")
    assert tab.value("document.querySelector('#found mark').textContent") == "~/plan_path"
    assert search(tab, "(a") != search(tab, "qqqq") == ["Nothing has this word."]
    assert tab.problems == []
