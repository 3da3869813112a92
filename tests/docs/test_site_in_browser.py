"""The site in a real Chromium, once `nox -s site` has made it: silent, whole, for phones too, searchable."""

import os
import re
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from docsite.reference import ROLES
from docsite.site import HTML

from support.browser import LACKING, browser
from support.paths import DOCS
from support.selection import a_share, since
from vedette.config.registry import Registry

HTML = Path(os.environ.get("VEDETTE_SITE", HTML))
BUILT = (HTML / "index.html").exists()
pytestmark = [
    pytest.mark.skipif(LACKING is not None, reason=str(LACKING)),
    pytest.mark.skipif(not BUILT, reason="needs the site: cd docs && python -m docsite build"),
]
WIDE, PHONE = (1200, 900), (400, 800)
KINDS = sorted(
    {(entry.role, entry.kind) for entry in Registry.installed() if entry.distribution == "vedette" and entry.role in ROLES}
)
BROKEN_NAMES = """[...document.querySelectorAll('td code')]
    .filter((code) => /^\\w+$/.test(code.textContent) && code.getClientRects().length > 1).map((code) => code.textContent)"""
CURES = [
    re.sub(r"[^\w ]", " ", line.removeprefix("### ")).strip()
    for line in (DOCS / "errors.md").read_text(encoding="utf-8").splitlines()
    if line.startswith("### ")
]


class Quiet(SimpleHTTPRequestHandler):
    """A server that says nothing."""

    def log_message(self, *_):
        """Say nothing."""


@pytest.fixture(scope="module")
def address():
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(HTML))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.fixture(scope="module")
def running():
    with browser() as running:
        yield running


def opened(running, size):
    tab = running.new_page(viewport={"width": size[0], "height": size[1]})
    said = []
    tab.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.on("response", lambda response: said.append(f"{response.status} {response.url}") if response.status >= 400 else None)
    tab.on("request", lambda request: None if "127.0.0.1" in request.url else said.append(f"asks for {request.url}"))
    return tab, said


@pytest.fixture(scope="module")
def tried(pytestconfig):
    """What chooses the fifth that this commit draws; by night, and with `--all`, all."""
    what = None if pytestconfig.option.all or pytestconfig.option.vedette_profile == "nightly" else since()
    return lambda names: list(names) if what is None else a_share(names, what.head)


@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["desktop", "phone"])
@pytest.mark.costly
def test_pages_say_nothing_show_their_pictures_and_need_no_scrolling_sideways(running, address, size, tried):
    tab, said = opened(running, size)
    pages = [path for path in sorted(HTML.rglob("*.html")) if path.name != "404.html"]
    shown = [path for path in pages if not {"kinds", "files", "api"} & set(path.relative_to(HTML).parts)]
    some = [path for path in pages if path not in shown][::10]
    wrong = []
    for name in tried(path.relative_to(HTML).as_posix() for path in [*shown, *some]):
        tab.goto(f"{address}/{name}", wait_until="load")
        broken = tab.evaluate("[...document.images].filter((i) => i.loading != 'lazy' && !i.naturalWidth).map((i) => i.src)")
        wide = tab.evaluate("document.documentElement.scrollWidth > window.innerWidth + 1")
        names = tab.evaluate(BROKEN_NAMES)
        said += ["scrolls sideways"] if wide else []
        wrong += [f"{name}: {what}" for what in [*said, *broken, *(f"breaks {one}" for one in names)]]
        said.clear()
    assert wrong == []


def found(tab, field, what, ending):
    """Tell whether one of the first five results for some words leads to a page; the search takes its time."""
    field.fill(what)
    links = "all => all.filter((a) => a.getRootNode() !== document).map((a) => a.href)"
    for _ in range(100):
        tab.wait_for_timeout(30)
        first = tab.locator("a").evaluate_all(links)[:5]
        if any(address.partition("?")[0].endswith(ending) for address in first):
            return True
    return False


@pytest.mark.costly
def test_search_finds_each_kind_and_each_cure(running, address, tried):
    tab, said = opened(running, WIDE)
    tab.goto(f"{address}/index.html", wait_until="load")
    tab.keyboard.press("/")
    tab.wait_for_timeout(1000)
    field = tab.locator("input[type=text]").last
    kinds = tried(f"{role}/{kind}" for role, kind in KINDS)
    lost = [one for one in kinds if not found(tab, field, one.partition("/")[2], f"/{one}.html")]
    lost += [cure for cure in tried(CURES) if not found(tab, field, cure, "/errors.html")]
    assert lost == []
    assert said == []


@pytest.mark.parametrize(("name", "scheme"), [("index.html", "dark"), ("api/vedette.errors.html", "light")])
@pytest.mark.costly
def test_pages_have_no_serious_fault_for_those_who_do_not_see_well(running, address, name, scheme):
    axe = pytest.importorskip("axe_core_python.sync_playwright")
    tab = running.new_page(viewport={"width": 1200, "height": 900}, color_scheme=scheme)
    tab.goto(f"{address}/{name}", wait_until="load")
    faults = axe.Axe().run(tab)["violations"]
    assert [fault["id"] for fault in faults if fault["impact"] in ("serious", "critical")] == []
