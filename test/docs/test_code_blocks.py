"""Every block of code on a page runs as a reader runs it, and prints what the page says."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from code_blocks import DRAWN, pages, read_blocks, ROOT, RUN
from domains import own_domain
from node_harness import environment
import pytest
from reader import Reader

PAGES = pages()
NOT_RUN = 6
"""Blocks that nothing can run here: a ceiling."""


def name(page):
    """Return a page as one names it."""
    return page.relative_to(ROOT).as_posix()


def read_page(page, folder):
    """Run a page's blocks."""
    folder.mkdir()
    with own_domain() as domain:
        Reader(page, folder, environment(domain)).run(read_blocks(page))


@pytest.fixture(scope="module")
def readers(request, tmp_path_factory):
    """Readers of all pages that are asked for, two at a time, as pages wait for their nodes."""
    items = [item for item in request.session.items if item.fspath == request.node.path]
    asked = {item.callspec.params["page"] for item in items if hasattr(item, "callspec")}
    folder = tmp_path_factory.mktemp("pages")
    with ThreadPoolExecutor(2) as pool:
        yield {page: pool.submit(read_page, page, folder / page.stem) for page in sorted(asked)}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_blocks_run_as_a_reader_runs_them(readers, page):
    """In new processes, with a real node, and nothing is waited for that they don't wait for."""
    readers[page].result()


def test_every_block_is_run_compared_or_says_why_not():
    """Drawings are "text", what is not run has a reason, and these become fewer."""
    blocks = [block for page in PAGES for block in read_blocks(page)]
    for block in blocks:
        assert block.language in RUN | {DRAWN} or block.mark, (
            f"{block.place}: neither run nor compared, nor marked"
        )
        assert block.mark != "not run" or len(block.reason.split()) > 3, block.place
    assert sum(block.mark == "not run" for block in blocks) <= NOT_RUN


def test_transcripts_of_examples_are_compared_by_the_examples_own_tests():
    """Each names the example that prints it; its test compares."""
    tests = "".join(path.read_text() for path in Path(ROOT, "test", "examples").glob("test_*.py"))
    marked = [block for page in PAGES for block in read_blocks(page) if block.mark == "printed by"]
    assert marked
    for block in marked:
        assert f'transcript("{block.reason}")' in tests, block.place
