"""The commands of the manual run as printed and give the numbers that the manual prints; its links lead somewhere, its options exist.

    cargo build --release
    python3 tests/peers/tutorials.py target/release/bonepd-ct
    python3 tests/peers/tutorials.py target/release/bonepd-ct --core FOLDER --tibia FOLDER

Of a page, every `sh` block is run, in the order of the page and in one new folder, except those under `<!-- not run -->`. Then each
table under `<!-- check FILE KEYS -->` is compared with that CSV file (or the one row of a JSON file): its header names columns, the columns KEYS choose the row (the
last one that matches), the others are numbers or words. Tutorials 2 and 3 need public data, in folders that the user names: `$CORE` and `$TIBIA` in
their commands. `--print` shows what was found.
"""

import argparse
import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
# Solves of the manual are known to 0.1 % (where a page says `<!-- check … 1% -->`, to that: recipe `quick`), by another processor's
# rounding perhaps to the other side.
TOLERANCE = 0.002


def blocks(page):
    """The commands of a page that are to be run, one text."""
    found = re.findall(r"(<!-- not run -->\s*)?^```sh\n(.*?)^```", page, re.S | re.M)
    return "\n".join(code for skipped, code in found if not skipped)


def tables(page):
    """(file, keys, tolerance, header, rows) of each table that is to be compared."""
    pattern = r"<!-- check (\S+) (\S+)(?: (\S+)%)? -->\n((?:\|.*\n)+)"
    for file, keys, percent, table in re.findall(pattern, page):
        rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in table.splitlines()]
        header = [cell.split(" (")[0].strip("`") for cell in rows[0]]
        yield file, keys.split(","), float(percent) / 100 if percent else TOLERANCE, header, rows[2:]


def number(word):
    try:
        return float(word.replace("−", "-").replace(" ", "").rstrip("%"))
    except ValueError:
        return None


def key_is(found, printed):
    a, b = number(found), number(printed)
    return found == printed if a is None or b is None else abs(a - b) <= 1e-6 * abs(b)


def same(found, printed, tolerance):
    """Equal within the tolerance and half of the last digit that is printed."""
    a, b = number(found), number(printed)
    if a is None or b is None:
        return found == printed
    digits = len(printed.partition(".")[2])
    return abs(a - b) <= tolerance * abs(b) + 0.51 * 10.0**-digits


def check(folder, page, show):
    wrong = 0
    for file, keys, tolerance, header, rows in tables(page):
        if not (folder / file).exists():
            print(f"FAILED   {file} was not written")
            wrong += 1
            continue
        with open(folder / file, encoding="utf-8") as handle:
            lines = [json.load(handle)] if file.endswith(".json") else list(csv.DictReader(handle))
        lines = [{key: str(value) for key, value in line.items()} for line in lines]
        for row in rows:
            printed = dict(zip(header, row))
            matching = [line for line in lines if all(key_is(line[k], printed[k]) for k in keys)]
            if not matching:
                print(f"FAILED   {file}: no row {[printed[k] for k in keys]}")
                wrong += 1
                continue
            found = matching[-1]
            bad = [k for k in header if k not in keys and not same(found[k], printed[k], tolerance)]
            wrong += len(bad)
            for k in bad:
                print(f"FAILED   {file} {[printed[k] for k in keys]}: {k} is {found[k]}, the page says {printed[k]}")
            if show:
                print("  ", file, {k: found[k] for k in header})
    return wrong


def run(name, program, environment, show):
    page = (DOCS / name).read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        (folder / "sample_data").symlink_to(ROOT / "sample_data")
        (folder / "pipelines").symlink_to(ROOT / "pipelines")
        (folder / "bin").mkdir()
        (folder / "bin/bonepd-ct").symlink_to(program)
        path = f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
        command = ["bash", "-e", "-o", "pipefail", "-c", blocks(page)]
        done = subprocess.run(command, cwd=folder, env={**os.environ, "PATH": path, **environment}, capture_output=True, text=True)
        if done.returncode:
            print(done.stdout[-2000:], done.stderr[-2000:], sep="\n")
            print(f"FAILED   {name}: a command ended with exit code {done.returncode}")
            return 1
        wrong = check(folder, page, show)
    compared = sum(len(t[4]) for t in tables(page))
    print(f"{'FAILED' if wrong else 'ok':8} {name}: {compared} rows compared, {wrong} values differ")
    return wrong


def pages():
    """All pages of the manual, with the folder that their links start from."""
    return [ROOT / "README.md", ROOT / "pipelines/README.md", *sorted(DOCS.rglob("*.md")), *sorted((ROOT / "reports").glob("*.md"))]


def links():
    """Relative links that lead nowhere."""
    wrong = 0
    for page in pages():
        text = page.read_text(encoding="utf-8")
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            if re.match(r"[a-z]+:", target):
                continue
            file, _, anchor = target.partition("#")
            found = (page.parent / file).resolve() if file else page
            if not found.exists():
                print(f"FAILED   {page.relative_to(ROOT)}: {target} leads nowhere")
                wrong += 1
            elif anchor:
                heads = re.findall(r"^#+ (.*)", found.read_text(encoding="utf-8"), re.M)
                if anchor not in [re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads]:
                    print(f"FAILED   {page.relative_to(ROOT)}: {target} has no such heading")
                    wrong += 1
    print(f"{'FAILED' if wrong else 'ok':8} links: {wrong} lead nowhere")
    return wrong


def flags(program):
    """Options in the commands of all pages that the program does not have."""
    known, wrong = {}, 0
    for page in pages():
        text = page.read_text(encoding="utf-8").replace("\\\n", " ")
        for verb, rest in re.findall(r"bonepd-ct (\w+)([^\n`#|]*)", "\n".join(re.findall(r"^```sh\n(.*?)^```", text, re.S | re.M))):
            if verb not in known:
                known[verb] = subprocess.run([program, verb, "--help"], capture_output=True, text=True).stdout
            for flag in re.findall(r"(?<!\S)--[a-z-]+", rest):
                if not re.search(re.escape(flag) + r"(?![\w-])", known[verb]):
                    print(f"FAILED   {page.relative_to(ROOT)}: `bonepd-ct {verb}` has no {flag}")
                    wrong += 1
    print(f"{'FAILED' if wrong else 'ok':8} options: {wrong} that the program does not have")
    return wrong


def keys(program):
    """Keys of the methods paragraph that no result file or recipe has."""
    text = (DOCS / "methods-paragraph.md").read_text(encoding="utf-8")
    columns = subprocess.run([program, "columns"], capture_output=True, text=True).stdout
    recipe = subprocess.run([program, "recipe", "paper"], capture_output=True, text=True).stdout
    # Not columns: of the program, of groups.csv (`scans`, `n`), the recipe's `error`, and a sentence of answer.json.
    others = {"version", "n_scans", "n_subjects", "error_target", "conditions"}
    wrong = [
        key
        for key in sorted(set(re.findall(r"\{(\w+)\}", text)) - others - {"key"})
        if not re.search(rf"^  {key} ", columns, re.M) and not re.search(rf"\b{key} =", recipe)
    ]
    for key in wrong:
        print(f"FAILED   methods-paragraph.md: nothing is called {key}")
    print(f"{'FAILED' if wrong else 'ok':8} keys of the methods paragraph: {len(wrong)} do not exist")
    return len(wrong)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--core", type=pathlib.Path, help="folder of the 200 slices of tutorial 2")
    parser.add_argument("--tibia", type=pathlib.Path, help="folder with labels.npz of tutorial 3")
    parser.add_argument("--print", action="store_true", dest="show")
    parser.add_argument("--only", help="one page, as tutorials/1-sample-data.md")
    args = parser.parse_args()
    tutorials = [
        ("tutorials/1-sample-data.md", {}, None),
        ("conditions.md", {}, None),
        ("models.md", {}, None),
        ("tutorials/2-core.md", {"CORE": args.core}, "--core FOLDER: the slices named in the page"),
        ("tutorials/3-tibia.md", {"TIBIA": args.tibia}, "--tibia FOLDER: the files named in the page"),
    ]
    wrong = 0 if args.only else links() + flags(args.program.resolve()) + keys(args.program.resolve())
    for name, environment, missing in tutorials:
        if args.only and name != args.only:
            continue
        if any(value is None for value in environment.values()):
            print(f"skipped: {name} needs {missing}")
            continue
        environment = {key: str(value.resolve()) for key, value in environment.items()}
        wrong += run(name, args.program.resolve(), environment, args.show)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
