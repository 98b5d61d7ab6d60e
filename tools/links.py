#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Finds links in the Markdown pages that lead nowhere: to a file or a heading that does not exist.

    tools/links.py [--root DIR]      prints each dead link with its page and line; exit code 1 if there is one

The pages are every Markdown file of the top folder, docs and assets. Addresses on the web are not tried.
"""

import argparse
import os
import re
import sys


def plain(text):
    """The text of a heading as it is read: links by their words, without emphasis."""
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return re.sub(r"\*\*|__|(?<!\w)[*_](?=\w)|(?<=\S)[*_](?!\w)", "", text)


def anchors(path):
    """The names under which a page's headings can be linked, as GitHub makes them."""
    with open(path, encoding="utf-8") as file:
        headings = re.findall(r"^#{1,6} +(.*?)\s*$", file.read(), re.M)
    return {re.sub(r"[^\w\- ]", "", plain(h.replace("`", "")).lower()).replace(" ", "-") for h in headings}


def dead_links(path):
    """-> [(line number, target)] for links to a file or heading that does not exist; web addresses are not tried."""
    with open(path, encoding="utf-8") as file:
        text = re.sub(r"^(```.*?^```|    .*?)$", lambda m: "\n" * m[0].count("\n"), file.read(), flags=re.M | re.S)
    found = []
    for link in re.finditer(r"\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", lambda m: " " * len(m[0]), text)):
        if re.match(r"[a-z]+:", link[1]):
            continue
        name, _, anchor = link[1].partition("#")
        if re.match(r"\.\./\.\./(releases|issues|deployments)\b", name):
            continue  # part of the repository on GitHub, not a file
        target = os.path.join(os.path.dirname(path), name) if name else path
        if not os.path.exists(target) or (anchor and target.endswith(".md") and anchor not in anchors(target)):
            found.append((text.count("\n", 0, link.start()) + 1, link[1]))
    return found


def pages(root):
    found = [name for name in sorted(os.listdir(root)) if name.endswith(".md")]
    for top in ("docs", "assets"):
        for folder, _, names in sorted(os.walk(os.path.join(root, top))):
            found += [os.path.relpath(os.path.join(folder, name), root) for name in sorted(names) if name.endswith(".md")]
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--root", default=os.path.dirname(os.path.dirname(os.path.abspath(__file__))),
                        help="the folder that holds the pages")
    root = parser.parse_args().root
    names = pages(root)
    dead = 0
    for name in names:
        for line, target in dead_links(os.path.join(root, name)):
            print(f"{name}:{line}: a link to {target}, which does not exist")
            dead += 1
    print(f"links: {len(names)} pages, {dead} dead links")
    return 1 if dead else 0


if __name__ == "__main__":
    sys.exit(main())
