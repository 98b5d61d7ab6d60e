# SPDX-License-Identifier: MIT
"""Part 6: reports of data sets with hostile names must hold no markup from these, and cfg_args no code."""

import ast
import html.parser
import os
import re

import mutate
import samples

WEIGHT = 1
COMMANDS = [
    (["train", "{set}", "-o", "out/{name}", "--eval", *samples.TRAIN], ["out/{name}/report.html"], "out/{name}"),
    (["compare", "{set}", "-o", "out/{name}", "--kernels", "gaussian", "--iterations", "3", "-q", "--blending-views", "0"],
     ["out/{name}/compare.html"], None),
]
MARK = "7h0s71l3"
HARMLESS = set("p li ul td tr th span div details summary code figure g line text path circle rect polyline title".split())


class Outline(html.parser.HTMLParser):
    """The elements of a page with the names of their attributes, and what may run or load."""

    def __init__(self, known=frozenset()):
        super().__init__(convert_charrefs=True)
        self.known = known  # the elements that darb writes
        self.elements, self.suspicious, self.scripts, self.in_script = set(), [], 0, False

    def handle_starttag(self, tag, attributes):
        names = tuple(sorted(name for name, _ in attributes))
        self.elements.add((tag, names))
        self.in_script = tag == "script"
        self.scripts += self.in_script
        for name, value in attributes:
            if MARK in name or name.startswith("on") and (tag, names) not in self.known:
                self.suspicious.append(f"<{tag} {name}>")
            if name in ("href", "src") and re.match(r"\s*(javascript|vbscript|https?|//)", value or "", re.IGNORECASE):
                self.suspicious.append(f"<{tag} {name}={value[:80]}>")
        if MARK in tag:
            self.suspicious.append(f"<{tag}>")

    def handle_endtag(self, tag):
        self.in_script = False

    def handle_comment(self, data):
        if MARK in data:
            self.suspicious.append(f"comment {data[:80]}")

    def handle_data(self, data):
        if self.in_script and MARK in data and ("<" in data[data.index(MARK) - 40:data.index(MARK) + 40]):
            self.suspicious.append(f"in a script: {data[data.index(MARK) - 40:][:120]}")


def outline(path, known=frozenset()):
    page = Outline(known)
    with open(path, encoding="utf-8", errors="surrogateescape") as file:
        text = file.read()
    page.feed(text)
    page.close()
    return page, text


def hostile_name(rng):
    """A file name of at most 200 bytes."""
    name = "".join(rng.choice(mutate.HOSTILE_TEXT) for _ in range(rng.randrange(1, 3)))
    name = name.replace("/", rng.choice(["", "∕"])).replace("\0", "").replace("\n", rng.choice(["\n", ""]))
    name = MARK + name.encode("utf-8", "surrogateescape")[:150].decode("utf-8", "ignore")
    return name


def make_set(case, folder, photo):
    samples.write_photos(case.path(folder, "images"), photo)
    kind = case.random.randrange(2)
    if kind == 0:
        samples.colmap_binary(case.path(folder, "sparse/0"), photo)
    else:
        samples.transforms(case.path(folder), photo, masks=False)


def one(case):
    arguments, pages, run = case.random.choice(COMMANDS)
    plain = known_outline(case, arguments, pages)
    name, folder = hostile_name(case.random), "in/" + hostile_name(case.random)
    stems = [hostile_name(case.random).replace("\n", "") for _ in range(samples.VIEWS)]

    def photo(i):
        return f"{stems[i]}{i}.{'jpg' if i % 2 else 'png'}"
    make_set(case, folder, photo)
    case.what = f"data set {folder!r}, photos {photo(0)!r}"
    case.guard()
    result = case.run([word.replace("{set}", folder).replace("{name}", name) for word in arguments])
    case.check_kept(("out",))
    for page in pages:
        path = case.path(page.replace("{name}", name))
        if os.path.exists(path):
            check_page(case, path, plain)
        elif result.code == 0:
            case.problem("no page", page)
    if run:
        check_cfg_args(case, case.path(run.replace("{name}", name), "cfg_args"))


def known_outline(case, arguments, pages):
    """Elements and scripts of the pages with plain names."""
    key = ("outline", arguments[0])
    if key not in case.day.store:
        elements, scripts = set(), 0
        make_set(case, "plain", samples.photo_name)
        case.run([word.replace("{set}", "plain").replace("{name}", "plain") for word in arguments], allowed=(0,))
        for page in pages:
            found, _ = outline(case.path(page.replace("{name}", "plain")))
            elements |= found.elements
            scripts += found.scripts
        case.day.store[key] = elements, scripts
    return case.day.store[key]


def check_page(case, path, plain):
    elements, scripts = plain
    page, text = outline(path, elements)
    for element in page.elements - elements:
        if element[0] not in HARMLESS:
            case.problem("markup of a name", f"<{element[0]} {element[1]}> is in no page of plain names")
    if page.scripts > scripts:
        case.problem("markup of a name", f"{page.scripts} scripts, {scripts} with plain names")
    for what in page.suspicious:
        case.problem("markup of a name", what)
    if not text.rstrip().endswith("</html>"):
        case.problem("page in part", text[-100:])


def check_cfg_args(case, path):
    """cfg_args must be one call of Namespace with constants, because 3DGS's tools evaluate it."""
    if not os.path.exists(path):
        return
    with open(path, encoding="utf-8", errors="surrogateescape") as file:
        text = file.read()
    try:
        call = ast.parse(text, mode="eval").body
        good = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "Namespace" and not call.args
        for keyword in call.keywords if good else []:
            ast.literal_eval(keyword.value)
    except (ValueError, SyntaxError, UnicodeError) as error:
        case.problem("cfg_args is no literal", f"{error}: {text[:200]!r}")
        return
    if not good:
        case.problem("cfg_args is code", text[:300])
