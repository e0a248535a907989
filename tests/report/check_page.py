"""Writes the sample reports with the given program and checks that they are well-formed.

usage: check_page.py WRITE_SAMPLE
"""
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

FORBIDDEN_TAGS = {"script", "link", "iframe", "object", "embed"}


def problems(path: pathlib.Path):
    text = path.read_text(encoding="utf-8")
    if not text.startswith("<!DOCTYPE html>"):
        yield "does not start with a doctype"
    for element in ElementTree.fromstring(text).iter():
        tag = element.tag.rsplit("}", 1)[-1]
        if tag in FORBIDDEN_TAGS:
            yield f"contains <{tag}>"
        for name, value in element.attrib.items():
            if name in {"src", "href"} and not value.startswith("data:"):
                yield f"<{tag}> loads {value[:60]}"
            if name in {"d", "x", "y", "cx", "cy"} and ("nan" in value or "inf" in value):
                yield f"<{tag}> is drawn at {value[:60]}"


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.argv[1], folder], check=True)
        pages = sorted(pathlib.Path(folder).glob("*.html"))
        found = [f"{page.name}: {problem}" for page in pages for problem in problems(page)]
    if len(pages) != 3:
        found.append(f"expected three pages, found {len(pages)}")
    print("\n".join(found) or "report: every page is well-formed and stands alone")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
