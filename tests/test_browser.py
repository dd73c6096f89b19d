"""The pages of reports in Chromium: nothing overflows, all is seen and legible, paper fits.

They are skipped where Chromium or playwright is missing, unless ACCELCAL_REQUIRE_BROWSER is set.
"""

import itertools
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest

import accelcal
from accelcal.io.toml.specification import read_specification
from accelcal.page.render import browser
from accelcal.page.write import write_report
from accelcal.verdict.judge import judge

EXAMPLES = Path(__file__).parents[1] / "examples"
QUIET = (
    *("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run"),
    *("--disable-component-update", "--disable-sync"),
)
PAPER = 680  # CSS pixels between the margins of A4
PAGES = ("calibration", "mountings", "discovery", "nothing")

CONTRAST = """() => {
  const rgb = text => (text.match(/[\\d.]+/g) || []).map(Number);
  const light = ([r, g, b]) => {
    const part = v => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
    return 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
  };
  const ground = element => {
    for (let e = element; e; e = e.parentElement) {
      const found = rgb(getComputedStyle(e).backgroundColor);
      if (found.length && (found.length < 4 || found[3] > 0.5)) return found;
    }
    return rgb(getComputedStyle(document.body).backgroundColor);
  };
  const bad = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  let seen = 0;
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    if (!walker.currentNode.data.trim() || !element.getClientRects().length) continue;
    const style = getComputedStyle(element);
    const ink = element.namespaceURI.endsWith('svg') ? style.fill : style.color;
    const [a, b] = [light(rgb(ink)), light(ground(element))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    const size = parseFloat(style.fontSize), bold = Number(style.fontWeight) >= 700;
    const wanted = size >= 24 || (bold && size >= 18.66) ? 3 : 4.5;
    seen += 1;
    if (ratio < wanted) bad.push([walker.currentNode.data.trim(), ink, ratio]);
  }
  return { seen, bad };
}"""

FIGURES = """() => [...document.querySelectorAll('figure:not(.tabled)')].map(figure => {
  const shown = [...figure.querySelectorAll('svg')].map(svg => svg.getBoundingClientRect())
    .filter(box => box.width > 0);
  return shown.map(box => [box.width, box.height]);
})"""

BEYOND = """edge => [...document.querySelectorAll('table, svg, p, li, dd, h1, h2, h3')]
  .map(e => [e.tagName, e.getBoundingClientRect().right, e.textContent.trim().slice(0, 40)])
  .filter(([, right]) => right > edge + 1)"""


def needed(reason):
    """Skip, or fail where a browser must be there."""
    if os.environ.get("ACCELCAL_REQUIRE_BROWSER"):
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture(scope="module")
def chromium():
    program = browser()
    if program is None:
        needed("no Chromium, Chrome or Edge on this machine")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        needed('no playwright; install it with: pip install "accelcal[browser]"')
    with sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=program, args=list(QUIET))
        yield found
        found.close()


def failing():
    found = accelcal.fit(accelcal.read_table(EXAMPLES / "al15.csv"))
    return replace(found, verdict=judge(found, read_specification(str(EXAMPLES / "al15.toml"))))


def two_mountings():
    plan = accelcal.TumblePlan(mountings=("o+", "o-"), temperatures=(20.0,))
    return accelcal.fit(accelcal.simulate(plan=plan, seed=4))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    record = accelcal.simulate(effects=[accelcal.effect("backlash").of(5e-5)], seed=1)
    write_report([failing()], folder / "calibration.html")
    write_report([two_mountings()], folder / "mountings.html")
    write_report([accelcal.discover(record)], folder / "discovery.html", records=[record])
    write_report([accelcal.discover(accelcal.simulate(seed=2))], folder / "nothing.html")
    return folder


@pytest.fixture(params=PAGES)
def opened(chromium, folder, request):
    """A page that fails the test where it complains, or asks for anything from outside."""
    page = chromium.new_page(viewport={"width": 1100, "height": 900})
    said, asked = [], []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda wish: asked.append(wish.url))
    page.goto((folder / f"{request.param}.html").as_uri())
    yield page
    page.close()
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


def unfold(page):
    page.evaluate("document.querySelectorAll('details').forEach(e => e.open = true)")


def test_nothing_overflows(opened):
    unfold(opened)
    for width in (320, 360, 768, 1100):
        opened.set_viewport_size({"width": width, "height": 800})
        assert opened.evaluate("document.documentElement.scrollWidth") <= width


def test_text_is_legible(opened):
    unfold(opened)
    for scheme in ("light", "dark"):
        opened.emulate_media(color_scheme=scheme)
        found = opened.evaluate(CONTRAST)
        assert found["seen"] > 40
        assert found["bad"] == []


def test_illegible_text_would_be_found(opened):
    opened.add_style_tag(content=":root { --muted: #9aa0a6 }")
    assert opened.evaluate(CONTRAST)["bad"]


def test_every_picture_is_seen_once(opened):
    for width, scheme in itertools.product((360, 1100), ("light", "dark")):
        opened.set_viewport_size({"width": width, "height": 800})
        opened.emulate_media(color_scheme=scheme)
        for shown in opened.evaluate(FIGURES):
            assert len(shown) == 1
            assert min(shown[0]) > 150


def test_paper_is_not_left(opened):
    opened.emulate_media(media="print")
    opened.set_viewport_size({"width": PAPER, "height": 900})
    unfold(opened)
    assert opened.evaluate(BEYOND, PAPER) == []


def test_the_name_of_a_table_stays_with_it_on_paper(opened):
    opened.emulate_media(media="print")
    own = "[...document.querySelectorAll('details')].map(one => getComputedStyle(one).breakInside)"
    assert set(opened.evaluate(own)) <= {"avoid"}
    names = "[...document.querySelectorAll('summary')].map(one => getComputedStyle(one).breakAfter)"
    assert set(opened.evaluate(names)) <= {"avoid"}


def test_the_pdf_is_a4(chromium, folder):  # noqa: ARG001  (the browser must be there)
    write_report([accelcal.discover(accelcal.simulate(seed=2))], folder / "nothing.pdf")
    data = (folder / "nothing.pdf").read_bytes()
    boxes = re.findall(rb"/MediaBox ?\[([^\]]+)\]", data)
    assert boxes
    for box in boxes:
        x, y, width, height = map(float, box.split())
        assert (x, y) == (0.0, 0.0)
        assert width == pytest.approx(595.3, abs=1.0)
        assert height == pytest.approx(841.9, abs=1.0)
