"""The report's page in a real browser: tables sort by a click on their heads, links reach the scans, nothing is asked of the network.

    python3 -m venv venv && venv/bin/pip install playwright
    cargo build --release
    venv/bin/python tests/peers/report.py              # takes Debian's chromium; else `playwright install chromium` first

Pictures of the page, 1280 pixels wide and as printed, go to FOLDER with `--pictures FOLDER`.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/bonepd-ct"

try:
    from playwright.sync_api import sync_playwright
except ImportError as e:
    sys.exit(f"skipped: {e}; pip install playwright")

# Text and key to sort by of each cell, row by row; NaN and infinities are not JSON.
CELLS = """table => Array.from(table.tBodies[0].rows).map(row =>
    Array.from(row.cells).map(cell => [cell.textContent, cell.dataset.key ?? null]))"""


def ordered(cells, column):
    """Whether a column ascends: numbers by their keys, words by themselves."""
    keys = [row[column][1] for row in cells]
    if all(key is not None for key in keys):
        values = [float(key.replace("Infinity", "inf")) for key in keys]
    else:
        values = [row[column][0].casefold() for row in cells]
    return values == sorted(values), len(set(values))


def check_tables(page):
    tables = page.query_selector_all("table.sortable")
    assert tables, "no table can be sorted"
    clicked = 0
    for table in tables:
        for column, head in enumerate(table.query_selector_all("th")):
            before = table.evaluate(CELLS)
            head.click()
            up = table.evaluate(CELLS)
            assert head.get_attribute("aria-sort") == "ascending"
            assert sorted(map(str, before)) == sorted(map(str, up)), "rows were lost or mixed"
            fine, different = ordered(up, column)
            assert fine, (head.inner_text(), [row[column] for row in up])
            head.click()
            down = table.evaluate(CELLS)
            assert head.get_attribute("aria-sort") == "descending"
            assert ordered(down[::-1], column)[0], (head.inner_text(), [row[column] for row in down])
            if different > 1:
                clicked += 1
                assert [row[column] for row in up] != [row[column] for row in down], head.inner_text()
            marked = table.query_selector_all("th[aria-sort]")
            assert len(marked) == 1, f"{len(marked)} heads are marked as sorted"
    return len(tables), clicked


def check_links(page):
    links = page.query_selector_all('a[href^="#"]')
    for link in links:
        name = link.get_attribute("href")[1:]
        assert page.evaluate("name => document.getElementById(name) !== null", name), f"#{name} leads nowhere"
    return len(links)


def main():
    pictures = pathlib.Path(sys.argv[2]) if sys.argv[1:2] == ["--pictures"] else None
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as browsers:
        words = [PROGRAM, "run", ROOT / "pipelines/quick.toml", ROOT / "sample_data", "-o", folder, "--quiet"]
        subprocess.run(words, check=True)
        installed = shutil.which("chromium") or shutil.which("google-chrome")
        browser = browsers.chromium.launch(executable_path=installed, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        asked, wrong = [], []
        page.on("request", lambda request: asked.append(request.url))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
        page.goto((pathlib.Path(folder) / "report/report.html").as_uri())
        if pictures:
            pictures.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=pictures / "report.png", full_page=True)
            page.pdf(path=pictures / "report.pdf", format="A4", print_background=True)
        # Methods, times and validation are behind folds.
        page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
        tables, columns = check_tables(page)
        links = check_links(page)
        page.set_viewport_size({"width": 390, "height": 844})
        if pictures:
            page.screenshot(path=pictures / "phone.png", full_page=True)
        narrow = page.evaluate("document.documentElement.scrollWidth")
        assert narrow <= 390, f"the page is {narrow} pixels wide on a phone"
        page.set_viewport_size({"width": 1280, "height": 900})
        outside = [url for url in asked if not url.startswith(("file:", "data:"))]
        assert not outside, f"the page asks for {outside}"
        assert not wrong, wrong
        wide = page.evaluate("document.documentElement.scrollWidth")
        assert wide <= 1280, f"the page is {wide} pixels wide"
        browser.close()
    print(f"ok: {columns} columns of {tables} tables sort both ways, {links} links lead somewhere, nothing was asked of the network")


main()
