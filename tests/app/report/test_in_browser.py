"""Reports in a real browser: slider, keys, filters, no request, texts that stay texts, and axe's check of access."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser import Watched, browser
from report_records import HOSTILE, rich_record
from test_campaign_report import write_campaign

from regrasp.app.report.campaign_report import campaign_page
from regrasp.app.report.run_report import run_page

LEAK = "fetch('https://example.com/x').then(() => 'left', () => 'held')"


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages run.html, hostile.html, campaign.html and worse.html, the last of a campaign with hostile texts."""
    folder = tmp_path_factory.mktemp("pages")
    for name, hostile in (("run", False), ("hostile", True)):
        (folder / f"{name}.html").write_bytes(run_page(rich_record(folder / name, hostile))[0])
    write_campaign(folder / "campaign", 30, lambda seed: seed % 3 == 0, folder / "run")
    bad: dict[str, Any] = {"words": HOSTILE, "scenario": HOSTILE, "case": HOSTILE, "outcome": HOSTILE}
    write_campaign(folder / "worse", 6, lambda seed: seed % 2 == 0, **bad)
    for name in ("campaign", "worse"):
        (folder / f"{name}.html").write_bytes(campaign_page(str(folder / name)))
    return folder


@pytest.fixture
def opened(chromium: Any, pages: Path, request: pytest.FixtureRequest) -> Iterator[Watched]:
    """The page that the test names; at its end nothing has gone wrong and nothing was asked of the network."""
    context = chromium.new_context(viewport={"width": 1280, "height": 900})
    watched = Watched(context.new_page(), pages / request.param)
    yield watched
    context.close()
    assert watched.wrong == []
    assert watched.requests == []


def of(name: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("opened", [f"{name}.html"], indirect=True, ids=[name])


def state(page: Any) -> dict[str, Any]:
    """What the page shows of its moment."""
    return dict(
        page.evaluate(
            """() => ({
              clock: document.getElementById("clock").textContent,
              picture: document.querySelector(".frame:not([hidden])")?.dataset.t ?? "none",
              running: document.getElementById("states").textContent,
              line: document.querySelector("#log tr.now td:last-child")?.textContent ?? "",
              gap: document.getElementById("reading-0-0").textContent,
              cursor: document.querySelector("#time-line .cursor").getAttribute("x1"),
              spoken: document.getElementById("moment").getAttribute("aria-valuetext"),
            })"""
        )
    )


@of("run")
def test_the_slider_moves_tree_pictures_curves_and_log_together(opened: Watched) -> None:
    page = opened.page
    slider = page.get_by_role("slider", name="Moment of the run")
    slider.focus()
    page.keyboard.press("Home")
    first = state(page)
    assert (first["clock"], first["picture"], first["gap"]) == ("0.00 s", "none", "50")
    assert "Running: root/mission/tries/one/try/grasp" in first["running"]
    for _ in range(10):
        page.keyboard.press("ArrowRight")
    second = state(page)
    assert (second["clock"], second["picture"], second["gap"]) == ("0.50 s", "0.5", "45")
    assert "slip" in second["line"]
    assert float(second["cursor"]) > float(first["cursor"])
    assert second["spoken"].startswith("0.50 seconds, ")
    page.keyboard.press("End")
    last = state(page)
    assert (last["picture"], "Failed: root" in last["running"]) == ("1.5", True)


@of("run")
def test_keys_and_links_go_to_events_and_failures(opened: Watched) -> None:
    page = opened.page
    page.evaluate("pick(0)")
    page.keyboard.press("n")
    assert state(page)["clock"] == "0.50 s"
    page.keyboard.press("f")
    assert state(page)["clock"] == "1.00 s"
    page.keyboard.press("b")
    assert state(page)["clock"] == "0.50 s"
    page.locator(".chain button").first.click()
    at_the_end = state(page)["clock"]
    page.locator("#time-line").click(position={"x": 190, "y": 60})
    assert state(page)["clock"] != at_the_end


@of("run")
def test_it_plays_and_stops_at_the_end(opened: Watched) -> None:
    page = opened.page
    page.evaluate("pick(0)")
    page.select_option("#speed", "5")
    page.locator("#play").click()
    page.locator("#play[aria-label=Pause]").wait_for(timeout=2000)
    page.locator("#play[aria-label=Play]").wait_for(timeout=5000)
    assert state(page)["clock"] == f"{page.evaluate('data.end'):.2f} s"


@of("run")
def test_the_log_is_filtered(opened: Watched) -> None:
    opened.page.fill("#filter", "planned")
    assert opened.page.locator("#log tbody tr:visible").count() == 2
    assert opened.page.locator("#found").text_content().startswith("2 of ")


@of("run")
def test_it_opens_within_a_second(opened: Watched) -> None:
    taken = opened.page.evaluate("performance.getEntriesByType('navigation')[0].loadEventEnd")  # ms
    assert taken < 1000


@pytest.mark.parametrize("name", ["run", "campaign"])
def test_the_policy_lets_nothing_out(chromium: Any, pages: Path, name: str) -> None:
    page = chromium.new_page()
    watched = Watched(page, pages / f"{name}.html")
    assert page.evaluate(LEAK) == "held"
    with page.expect_event("requestfailed") as stopped:
        page.evaluate("document.body.append(Object.assign(new Image(), {src: 'https://example.com/x.png'}))")
    assert stopped.value.failure == "csp"
    page.evaluate("document.body.insertAdjacentHTML('beforeend', '<p onclick=\"window.harm = 1\" id=sore>x</p>')")
    page.click("#sore")
    assert page.evaluate("window.harm") is None
    assert len(watched.wrong) >= 3  # each is told in the console
    page.close()


@pytest.mark.parametrize("opened", ["hostile.html", "worse.html"], indirect=True)
def test_hostile_texts_show_as_text(opened: Watched) -> None:
    page = opened.page
    assert page.evaluate("window.harm") is None
    assert "<script>window.harm" in page.locator("main").inner_text()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")  # nothing bursts the page
    assert page.locator("script").count() <= 2


@of("campaign")
def test_runs_are_filtered_sorted_and_opened(opened: Watched) -> None:
    page = opened.page
    rows = page.locator("#table tbody tr:visible")
    page.check("#failed-only")
    assert rows.count() == 10
    page.fill("#filter", "seed 27")
    assert rows.count() == 1
    page.fill("#filter", "")
    page.get_by_role("button", name="simulated s").click()
    page.get_by_role("button", name="simulated s").click()
    assert rows.first.locator("td").nth(5).text_content() == "24.0"
    page.locator("#table a").first.click()
    assert page.locator("details.run[open] pre").is_visible()


@pytest.mark.parametrize("opened", ["run.html", "campaign.html"], indirect=True)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_serious(opened: Watched, scheme: Any) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
    opened.page.emulate_media(color_scheme=scheme)
    found = axe.Axe().run(opened.page).response["violations"]
    serious = [(one["id"], one["nodes"][0]["html"][:160]) for one in found if one["impact"] in ("serious", "critical")]
    assert serious == []
