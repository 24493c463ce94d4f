"""The pages in a real browser: light, dark, narrow, in print, by keyboard, without scripts, and never calling out."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pages import HOSTILE, analysis, proof, story

from gsfdi.reports import proof_page, reconcile_page, to_html

webdriver = pytest.importorskip("selenium.webdriver")
BROWSER, DRIVER = shutil.which("chromium") or shutil.which("google-chrome"), shutil.which("chromedriver")
pytestmark = pytest.mark.skipif(not (BROWSER and DRIVER), reason="needs chromium and chromedriver")

LEVELS = ("normal", "critical", "warning", "distress", "not_assessed", "invalid_data", "stale")


def verdict_page() -> str:
    return to_html.write(analysis(*HOSTILE, levels=LEVELS))


def reconciled_page() -> str:
    stories = [story(joint, outcome) for joint, outcome in zip(HOSTILE, reconcile_page.HEADLINES, strict=False)]
    return reconcile_page.write(stories, [{"path": "<b>a.mcap", "sha256": "ab" * 32}], "2026-11-21T02:00:00Z")


def proof_sheet() -> str:
    return proof_page.write(proof())


PAGES = {"verdicts": verdict_page, "reconcile": reconciled_page, "proof": proof_sheet}


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    profile = tmp_path_factory.mktemp("profile")
    for argument in (
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-dev-shm-usage",
        f"--user-data-dir={profile}",
    ):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=DRIVER))
    yield driver
    driver.quit()


@pytest.fixture(params=sorted(PAGES))
def page(request: pytest.FixtureRequest, browser: Any, tmp_path: Path) -> Any:
    file = tmp_path / f"{request.param}.html"
    file.write_text(PAGES[request.param](), encoding="utf-8")
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    browser.set_window_size(1280, 1000)
    browser.get_log("browser")
    browser.get_log("performance")
    browser.get(file.as_uri())
    return browser


def media(browser: Any, kind: str, scheme: str = "light") -> None:
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": kind, "features": features})


LEAST_CONTRAST = """
const light = (colour) => {
  const [r, g, b] = colour.match(/[\\d.]+/g).slice(0, 3).map((v) => v / 255)
    .map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const behind = (node) => {
  for (let at = node; at; at = at.parentElement) {
    const colour = getComputedStyle(at).backgroundColor;
    if (!colour.endsWith(", 0)")) return colour;
  }
  return "rgb(255, 255, 255)";
};
let least = [99, ""];
for (const node of document.querySelectorAll("h1,h2,h3,p,dt,dd,td,th,a,summary,li,figcaption,.level,.plot text")) {
  if (!node.textContent.trim() || node.classList.contains("onfill") || node.classList.contains("skip")) continue;
  const style = getComputedStyle(node), ink = node.tagName === "text" ? style.fill : style.color;
  const [a, b] = [light(ink), light(behind(node.closest("svg")?.parentElement ?? node))].sort((x, y) => y - x);
  const ratio = (a + 0.05) / (b + 0.05);
  if (ratio < least[0]) least = [ratio, node.outerHTML.slice(0, 90)];
}
return least;
"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_text_can_be_read(page: Any, scheme: str) -> None:
    media(page, "screen", scheme)
    ratio, where = page.execute_script(LEAST_CONTRAST)
    assert ratio >= 4.5, where


def test_dark_is_dark_and_print_is_light(page: Any) -> None:
    paper = "return getComputedStyle(document.body).backgroundColor"
    media(page, "screen", "dark")
    dark = page.execute_script(paper)
    media(page, "print", "dark")
    assert page.execute_script(paper) == "rgb(255, 255, 255)"
    assert dark != "rgb(255, 255, 255)"


def test_nothing_runs_and_nothing_is_fetched(page: Any) -> None:
    assert [entry["message"] for entry in page.get_log("browser")] == []
    requests = [entry["message"] for entry in page.get_log("performance") if "requestWillBeSent" in entry["message"]]
    assert not [message for message in requests if '"url":"http' in message]
    assert page.execute_script("return document.scripts.length") == 1
    assert page.execute_script("return document.images.length") == 0


def test_ids_are_unique_and_links_lead_somewhere(page: Any) -> None:
    ids = page.execute_script("return [...document.querySelectorAll('[id]')].map((node) => node.id)")
    assert len(ids) == len(set(ids))
    links = page.execute_script("return [...document.links].map((link) => link.getAttribute('href'))")
    assert {link.removeprefix("#") for link in links} <= set(ids)


def test_every_drawing_says_what_it_shows(page: Any) -> None:
    unnamed = page.execute_script(
        "return [...document.querySelectorAll('svg.plot')].filter((plot) => plot.getAttribute('role') !== 'img' ||"
        " plot.getAttribute('aria-labelledby').split(' ').some((id) => !document.getElementById(id).textContent))"
        ".length"
    )
    assert unnamed == 0
    assert page.execute_script("return document.querySelectorAll('svg.plot').length") > 3


def test_a_telephone_needs_no_sideways_scrolling(page: Any) -> None:
    page.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride", {"width": 360, "height": 740, "deviceScaleFactor": 1, "mobile": False}
    )
    widths = page.execute_script("return [document.documentElement.scrollWidth, innerWidth]")
    page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    assert widths[0] <= widths[1]


def test_the_keyboard_reaches_everything(page: Any) -> None:
    keys = webdriver.common.keys.Keys
    reached = set()
    for _ in range(120):
        webdriver.ActionChains(page).send_keys(keys.TAB).perform()
        reached.add(page.execute_script("return document.activeElement.tagName"))
    assert {"SUMMARY", "BUTTON"} <= reached


def test_print_shows_what_a_click_would_open(page: Any) -> None:
    media(page, "print")
    # What a media query hides or shows is settled one frame later.
    heights = page.execute_async_script(
        "requestAnimationFrame(() => requestAnimationFrame(() => arguments[0]([...document.querySelectorAll("
        "'details:not([open]) > :nth-child(2)')].map((part) => part.getBoundingClientRect().height))))"
    )
    assert heights
    assert min(heights) > 10


def test_a_click_sorts_and_another_sorts_back(page: Any) -> None:
    first = "document.querySelector('table[data-sortable]')"
    rows = f"return [...{first}.tBodies[0].rows].map((row) => row.cells[0].dataset.key ?? row.cells[0].textContent)"
    before = page.execute_script(rows)
    for direction in ("ascending", "descending"):
        page.find_element("css selector", "table[data-sortable] th button").click()
        assert page.find_element("css selector", "th[aria-sort]").get_attribute("aria-sort") == direction
        after = page.execute_script(rows)
        assert sorted(after) == sorted(before)
    assert after != before


def test_it_reads_without_scripts(page: Any) -> None:
    page.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    page.refresh()
    page.find_element("css selector", "summary").click()
    assert page.find_elements("css selector", "details[open]")
    assert HOSTILE[0].lower() in page.find_element("css selector", "main").text.lower()
    page.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})


def test_the_worst_comes_first(browser: Any, tmp_path: Path) -> None:
    (tmp_path / "v.html").write_text(verdict_page(), encoding="utf-8")
    browser.get((tmp_path / "v.html").as_uri())
    levels = [cell.text for cell in browser.find_elements("css selector", "tbody td:first-child .level")]
    assert levels == [level.replace("_", " ") for level in to_html.WORST_FIRST]
