"""Links of pages.

check-links.py outside FOLDER   prints the files of the repository that Markdown pages in FOLDER link to and lack
check-links.py check FOLDER     fails if a link of an HTML page in FOLDER leads nowhere within it
"""

import os
import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


def outside(folder: Path) -> None:
    wanted = set()
    for page in folder.rglob("*.md"):
        text = re.sub(r"```.*?```", "", page.read_text(), flags=re.S)
        for link in re.findall(r"\]\(([^)#\s]+)", text) + re.findall(r'src="([^"]+)"', text):
            target = Path(os.path.normpath(page.parent / link)).relative_to(folder) if "://" not in link else None
            if target and not (folder / target).exists():
                wanted.add(target)
    for target in sorted(wanted):
        if not target.is_file():
            sys.exit(f"no such file: {target}")
        print(target)


class Links(HTMLParser):
    """The links and the anchors of one page."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(page.read_text())

    def handle_starttag(self, tag: str, attributes: list) -> None:
        for name, value in attributes:
            if name == "id":
                self.anchors.add(value)
            if name in ("href", "src") and value:
                self.links.append(value)


def check(folder: Path) -> None:
    # The page of a missing address has links from the root of a site.
    pages = {page: Links(page) for page in folder.rglob("*.html") if page.name not in ("404.html", "toc.html")}
    followed, broken = 0, []
    for page, found in sorted(pages.items()):
        for link in found.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = Path(os.path.normpath(page.parent / unquote(parts.path))) if parts.path else page
            followed += 1
            if not target.is_file():
                broken.append(f"{page}: {link}: no such file")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
                broken.append(f"{page}: {link}: no such heading")
    print(f"check-links: {len(pages)} pages, {followed} links, {len(broken)} lead nowhere")
    if broken or followed < 100:
        sys.exit("\n".join(broken))


{"outside": outside, "check": check}[sys.argv[1]](Path(sys.argv[2]))
