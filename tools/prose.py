#!/usr/bin/env python3
"""Length of the sentences of each page, in words: how many there are, the average, the longest. Links that lead nowhere.

    tools/prose.py [PAGE...] [--root DIR]    a line a page; default: every Markdown file of the top folder, docs and assets
    tools/prose.py --check                   prints only what is over the limits, and links to files and headings that are
                                             not there; exit code 1 if there is anything
    tools/prose.py --over N [PAGE...]        each sentence of more than N words, with its file and line

The limits: 25 words on average, 40 in any sentence. Headings, tables, code blocks, pictures and comments are left out.
A piece of inline code counts as one word, and so does a number. Each list item begins a sentence of its own.
"""

import argparse
import os
import re
import sys

AVERAGE, LONGEST = 25, 40  # words
ABBREVIATIONS = {"e.g.", "i.e.", "cf.", "vs.", "al.", "etc.", "no.", "fig.", "figs.", "eq.", "sec.", "approx.", "dr."}
ITEM = re.compile(r"( *)([-*+]|\d+[.)])( +)")


def blocks(text):
    """-> [(line number, text)] of each paragraph and list item; what is no prose is left out"""
    found, block, start = [], [], 0
    fence, comment, blank, code, inside = "", False, True, False, 0  # inside: column where a list item's text begins

    def close():
        if block:
            found.append((start, " ".join(block)))
            block.clear()

    for number, line in enumerate(text.splitlines(), 1):
        words, indent = line.strip(), len(line) - len(line.lstrip(" "))
        if fence:
            fence = "" if words.startswith(fence) else fence
            continue
        if comment or words.startswith("<!--"):
            close()
            comment, blank = "-->" not in words, True
            continue
        if not words:
            close()
            blank = True
            continue
        if blank and indent < inside and not ITEM.match(line):
            inside = 0  # the list is over
        code = indent >= inside + 4 and (blank or code)
        opened = re.match(r"(`{3,}|~{3,})", words)
        left_out = opened or code or re.match(r"#{1,6} |[-=*_]{3,}$|\|.*\|$|<\w|!\[[^\]]*\]\([^)]*\)$", words)
        if left_out:
            close()
            fence = opened[1] if opened else ""
            blank = True
            continue
        item = ITEM.match(line)
        if item and (inside or (item[1] == "" and not (block and item[2] not in ("-", "*", "+", "1.", "1)")))):
            close()
            inside, words = item.end(), line[item.end():].strip()
        elif words.startswith(">"):
            words = words.lstrip("> ")
        if not block:
            start = number
        block.append(words)
        blank = False
    close()
    return found


def plain(text):
    """The text as it is read: links by their words, inline code as one word."""
    text = re.sub(r"(`+)(.+?)\1", "code", text)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"<https?://[^>]*>", "address", text)
    return re.sub(r"\*\*|__|(?<!\w)[*_](?=\w)|(?<=\S)[*_](?!\w)", "", text)


def sentences(text):
    """-> [[word]] of a block"""
    found, words = [], []
    for word in plain(text).split():
        words.append(word)
        bare = word.rstrip(")]\"'").lstrip("(\"'[")
        initial = re.fullmatch(r"[A-Z]\.", bare)
        if bare[-1:] in (".", "!", "?") and not initial and not bare.endswith("...") and bare.lower() not in ABBREVIATIONS:
            found.append(words)
            words = []
    found.append(words)
    counted = [[w for w in sentence if re.search(r"\w", w)] for sentence in found]
    return [sentence for sentence in counted if sentence]


def measure(path):
    """-> [(line number of its block, [word])] of a page"""
    with open(path, encoding="utf-8") as file:
        return [(line, sentence) for line, text in blocks(file.read()) for sentence in sentences(text)]


def anchors(path):
    """Names under which a page's headings are reached, as GitHub makes them."""
    with open(path, encoding="utf-8") as file:
        headings = re.findall(r"^#{1,6} +(.*?)\s*$", file.read(), re.M)
    return {re.sub(r"[^\w\- ]", "", plain(h.replace("`", "")).lower()).replace(" ", "-") for h in headings}


def dead_links(path):
    """-> [(line number, target)] of links to a file or heading that is not there; addresses of the web are not tried"""
    with open(path, encoding="utf-8") as file:
        text = re.sub(r"^(```.*?^```|    .*?)$", lambda m: "\n" * m[0].count("\n"), file.read(), flags=re.M | re.S)
    found = []
    for link in re.finditer(r"\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", lambda m: " " * len(m[0]), text)):
        if re.match(r"[a-z]+:", link[1]):
            continue
        name, _, anchor = link[1].partition("#")
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
    parser.add_argument("pages", nargs="*", metavar="PAGE")
    parser.add_argument("--root", default=os.path.dirname(os.path.dirname(os.path.abspath(__file__))),
                        help="the folder that pages are relative to")
    parser.add_argument("--check", action="store_true", help="say only what is over the limits")
    parser.add_argument("--over", type=int, metavar="N", help="show the sentences of more than N words")
    options = parser.parse_args()
    names = options.pages or pages(options.root)
    width = max([len(name) for name in names] + [4])
    if not options.check and options.over is None:
        print(f"{'page':<{width}}  sentences  average  longest")
    over = dead = 0
    for name in names:
        path = name if options.pages and os.path.exists(name) else os.path.join(options.root, name)
        try:
            found = measure(path)
        except OSError as error:
            sys.exit(f"{path}: {error.strerror}; name a Markdown file")
        lengths = [len(words) for _, words in found]
        average, longest = sum(lengths) / max(len(lengths), 1), max(lengths, default=0)
        bad = average > AVERAGE or longest > LONGEST
        over += bad
        limit = LONGEST if options.check else options.over
        if limit is not None:
            for line, words in found:
                if len(words) > limit:
                    print(f"{name}:{line}: a sentence of {len(words)} words: {' '.join(words[:8])} ...")
            if options.check and average > AVERAGE:
                print(f"{name}:1: {average:.1f} words a sentence on average, the limit is {AVERAGE}")
            for line, target in dead_links(path) if options.check else []:
                print(f"{name}:{line}: a link to {target}, which is not there")
                dead += 1
        else:
            print(f"{name:<{width}}  {len(lengths):9}  {average:7.1f}  {longest:7}{'  over' if bad else ''}")
    if options.check:
        print(f"prose: {len(names)} pages, {over} over {AVERAGE} words on average or {LONGEST} in a sentence, {dead} dead links")
    return 1 if (over and options.over is None) or dead else 0


if __name__ == "__main__":
    sys.exit(main())
