"""The page in a browser: it renders, needs nothing else, fits a phone and a desk, and prints what is folded away."""

import html
import json
import re
import shutil
import subprocess

import pytest

from vrsopt.report.markup import POLICY
from vrsopt.report.page import report_page
from vrsopt.report.plots import figures, png

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = [pytest.mark.slow, pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")]
QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    "--host-resolver-rules=MAP * ~NOTFOUND",  # no name is looked up
    "--enable-logging=stderr",
)
# Tells what the page is like into a comment at its end, once it has been drawn.
PROBE = """<script>
const wrong = [];
addEventListener("error", event => wrong.push(String(event.message || event.target.outerHTML).slice(0, 200)), true);
addEventListener("securitypolicyviolation", event => wrong.push(event.blockedURI));
addEventListener("load", () => {
  const all = [...document.querySelectorAll("body *")];
  const told = {
    wrong, width: innerWidth, needed: document.documentElement.scrollWidth,
    images: [...document.images].map(image => [image.complete, image.naturalWidth, image.clientWidth]),
    asked: performance.getEntriesByType("resource").map(one => one.name).filter(name => !name.startsWith("data:")),
    wider: all.filter(one => !one.closest(".wide, pre") && one.getBoundingClientRect().right > innerWidth + 1)
      .map(one => one.outerHTML.slice(0, 80)),
    headings: [...document.querySelectorAll("h2")].map(one => one.textContent),
    lost: [...document.querySelectorAll("nav a")].filter(a => !document.querySelector(a.getAttribute("href"))).length,
  };
  document.body.dataset.told = JSON.stringify(told);
});
</script>"""


@pytest.fixture(scope="module")
def page(comparison, mission_text):
    pictures = {name: png(figure) for name, figure in figures(comparison).items()}
    return report_page(comparison, pictures={"": pictures}, mission_text=mission_text, record={"a": "b" * 80})


def browse(folder, text, *options):
    """What the browser writes on standard output and error, for a page of this text."""
    file = folder / "page.html"
    file.write_text(text, encoding="utf-8")
    command = [BROWSER, *QUIET, f"--user-data-dir={folder / 'profile'}", *options, file.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    return done.stdout, done.stderr


def complaints(errors):
    return [line for line in errors.splitlines() if "CONSOLE" in line]


def probed(page):
    """The page with the probe, which its own policy would refuse."""
    assert POLICY in page
    return page.replace(POLICY, f"{POLICY}; script-src 'unsafe-inline'").replace("<head>", f"<head>{PROBE}")


@pytest.mark.parametrize("width", [360, 1280])
def test_the_page_renders_and_fits(page, tmp_path, width):
    opened = probed(page).replace("<details>", "<details open>")
    framed = html.escape(opened)  # in a frame, which may be narrower than a browser's window
    frame = f'<iframe id="f" srcdoc="{framed}" style="width: {width}px; height: 900px; border: 0"></iframe>'
    copy = (
        f"{frame}<script>addEventListener('load', () => {{ document.body.dataset.told = "
        "document.getElementById('f').contentDocument.body.dataset.told; })</script>"
    )
    found, errors = browse(tmp_path, f"<!DOCTYPE html><body style='margin: 0'>{copy}</body>", "--dump-dom")
    assert complaints(errors) == []
    told = json.loads(html.unescape(re.search(r'data-told="([^"]*)"', found).group(1)))
    assert told["width"] == width and told["needed"] <= width and told["wider"] == []
    assert told["wrong"] == [] and told["asked"] == [] and told["lost"] == 0
    assert len(told["images"]) == 7
    assert all(done and natural > 0 and shown >= min(width - 40, 320) for done, natural, shown in told["images"])
    assert "Where the saving comes from" in told["headings"] and "Inputs and their sources" in told["headings"]


def test_the_page_itself_has_nothing_to_complain_of(page, tmp_path):
    """As it is, with its policy: whatever it asked for beyond itself would be refused and said."""
    found, errors = browse(tmp_path, page, "--dump-dom")
    assert complaints(errors) == [] and "</h2>" in found
    _, errors = browse(tmp_path, page.replace("</body>", '<img src="https://example.org/a.png"></body>'), "--dump-dom")
    assert len(complaints(errors)) == 1  # so that the test above means something


def test_what_is_folded_away_is_printed(comparison, mission_text, tmp_path):
    """On as many sheets as with everything opened, and on more than without the rule. Pictures take long to print."""
    page = report_page(comparison, pictures={"": {}}, mission_text=mission_text, record={})
    opened, without = page.replace("<details>", "<details open>"), page.replace("details::details-content", "nothing")
    assert opened != page != without
    sheets = []
    for text in (page, opened, without):
        place = tmp_path / "page.pdf"
        browse(tmp_path, text, f"--print-to-pdf={place}", "--no-pdf-header-footer")
        sheets.append(len(re.findall(rb"/Type /Page\b", place.read_bytes())))
        place.unlink()
    assert sheets[0] == sheets[1] > sheets[2] > 1
