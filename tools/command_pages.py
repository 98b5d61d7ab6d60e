#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes man pages, and completion for bash, zsh and fish, from the option tables of a built darb.

  tools/command_pages.py DARB OUT    writes OUT/man1/darb*.1.gz, OUT/bash/darb, OUT/zsh/_darb, OUT/fish/darb.fish

Each command has a page, with the options that `darb COMMAND --help-all` shows.
"""
import gzip
import json
import os
import subprocess
import sys

EXITS = [("0", "Done."), ("1", "An internal error, or a check that failed."),
         ("2", "Bad usage or input, or what the system refuses, such as a full disk."),
         ("128 and the number of a signal", "It ended a run, which was saved.")]


def roff(text):
    """Escapes text so that troff shows it as it is."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("`", "\\(ga").replace("'", "\\(aq")
    return "\\&" + text if text[:1] in ".'" else text


def names_of(option):
    return ([option["positional"]] if option["positional"] else []) + option["names"]


def described(option):
    return option["help"] + (f" [{option['default']}]" if option["default"] else "")


def options_roff(options):
    lines, group = [], None
    for one in sorted(options, key=lambda o: [x["group"] for x in options].index(o["group"])):
        if one["group"] != group:
            group = one["group"]
            lines.append(f'.SS "{roff(group)}"')
        value = " \\fIVALUE\\fR" if one["takes_value"] and one["names"] else ""
        lines += [".TP", ", ".join(f"\\fB{roff(name)}\\fR" for name in names_of(one)) + value, roff(described(one))]
    return lines


def page(title, about, synopsis, body, version):
    head = [f'.TH {title.upper().replace("-", chr(92) + "-")} 1 "" "darb {version}" "darb"', ".SH NAME",
            f"{roff(title)} \\- {roff(about)}", ".SH SYNOPSIS", synopsis]
    exits = [".SH EXIT STATUS"]
    for code, meaning in EXITS:
        exits += [".TP", f"\\fB{code}\\fR", roff(meaning)]
    return "\n".join(head + body + exits) + "\n"


def man_pages(table):
    commands = table["commands"]
    body = [".SH DESCRIPTION", roff(table["help"]),
            ".PP", roff("Each command has a manual page of its own, such as darb-train(1)."), ".SH COMMANDS"]
    group = None
    for one in commands:
        if one["group"] != group:
            group = one["group"]
            body.append(f'.SS "{roff(group)}"')
        body += [".TP", f"\\fB{roff(one['name'])}\\fR", roff(one["help"])]
    body += [".SH OPTIONS"] + options_roff(table["options"])
    body += [".SH SEE ALSO", ", ".join(f"\\fBdarb\\-{one['name']}\\fR(1)" for one in commands)]
    about = "train, render and measure 3D splat scenes"
    yield "darb.1", page("darb", about, "\\fBdarb\\fR \\fICOMMAND\\fR [options]", body, table["version"])
    for one in commands:
        words = [f"\\fI{roff(o['positional'])}\\fR" if o["required"] else f"[\\fI{roff(o['positional'])}\\fR]"
                 for o in one["options"] if o["positional"]]
        synopsis = " ".join([f"\\fBdarb {one['name']}\\fR"] + words + ["[options]"])
        body = [".SH OPTIONS"] + options_roff(one["options"]) + [".SH SEE ALSO", "\\fBdarb\\fR(1)"]
        yield f"darb-{one['name']}.1", page(f"darb-{one['name']}", one["help"], synopsis, body, table["version"])


def named(options):
    return [o for o in options if o["names"]]


def all_names(options):
    return [name for o in named(options) for name in o["names"]]


def bash(table):
    cases = []
    for one in table["commands"]:
        values = "".join(f"            {'|'.join(o['names'])}) words=\"{' '.join(o['choices'])}\" ;;\n"
                         for o in named(one["options"]) if o["choices"])
        files = "|".join(name for o in named(one["options"]) if o["takes_value"] and not o["choices"] for name in o["names"])
        cases.append(f"    {one['name']})\n        options=\"{' '.join(all_names(one['options']))}\"\n"
                     f"        case $previous in\n{values}            {files or '-'}) options=\"\" ;;\n        esac ;;\n")
    commands = " ".join(one["name"] for one in table["commands"])
    return f"""# bash completion for darb, by tools/command_pages.py
_darb() {{
    local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}} options="" words=""
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        mapfile -t COMPREPLY < <(compgen -W "{commands} {' '.join(all_names(table['options']))}" -- "$current")
        return
    fi
    case ${{COMP_WORDS[1]}} in
{''.join(cases)}    esac
    if [[ -n $words ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
    elif [[ $current == -* ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$options" -- "$current")
    else
        compopt -o filenames 2>/dev/null
        mapfile -t COMPREPLY < <(compgen -f -- "$current")
    fi
}}
complete -F _darb darb
"""


def quoted(text):
    return "'" + text.replace("'", "'\\''") + "'"


def zsh(table):
    def spec(option):
        text = option["help"].replace("\\", "\\\\").replace("[", "\\[").replace("]", "\\]").replace(":", "\\:")
        value = f":value:({' '.join(option['choices'])})" if option["choices"] else ":value:_files"
        return [quoted(f"{name}[{text}]" + (value if option["takes_value"] else "")) for name in option["names"]]
    listed = "\n".join("        " + quoted(f"{one['name']}:{one['help'].replace(':', chr(92) + ':')}") for one in table["commands"])
    cases = []
    for one in table["commands"]:
        specs = [text for o in named(one["options"]) for text in spec(o)] + ["'*:file:_files'"]
        cases.append(f"        {one['name']})\n            _arguments \\\n                " + " \\\n                ".join(specs) + " ;;")
    top = " \\\n        ".join(text for o in named(table["options"]) for text in spec(o))
    return f"""#compdef darb
# zsh completion for darb, by tools/command_pages.py
_darb() {{
    local -a commands
    commands=(
{listed}
    )
    if ((CURRENT == 2)); then
        _describe command commands
        _arguments \\
        {top}
        return
    fi
    local command=$words[2]
    shift words
    ((CURRENT--))
    case $command in
{chr(10).join(cases)}
    esac
}}
_darb "$@"
"""


def fish(table):
    def line(option, condition):
        text = f"complete -c darb -n {quoted(condition)}"
        for name in option["names"]:
            text += f" -l {name[2:]}" if name.startswith("--") else f" -s {name[1:]}"
        if option["takes_value"]:
            text += " -r" + (f" -f -a {quoted(' '.join(option['choices']))}" if option["choices"] else "")
        return text + " -d " + quoted(option["help"])
    lines = ["# fish completion for darb, by tools/command_pages.py", "complete -c darb -n __fish_use_subcommand -f"]
    lines += [line(o, "__fish_use_subcommand") for o in named(table["options"])]
    for one in table["commands"]:
        lines.append(f"complete -c darb -n __fish_use_subcommand -f -a {one['name']} -d {quoted(one['help'])}")
        lines += [line(o, f"__fish_seen_subcommand_from {one['name']}") for o in named(one["options"])]
    return "\n".join(lines) + "\n"


def main():
    if len(sys.argv) != 3 or sys.argv[1] in ("-h", "--help"):
        print(__doc__.strip())
        return 0 if "--help" in sys.argv or "-h" in sys.argv else 2
    out = subprocess.run([sys.argv[1], "--options-json"], check=True, stdout=subprocess.PIPE).stdout
    table = json.loads(out)
    files = {f"man1/{name}.gz": text for name, text in man_pages(table)}
    files |= {"bash/darb": bash(table), "zsh/_darb": zsh(table), "fish/darb.fish": fish(table)}
    for name, text in files.items():
        path = os.path.join(sys.argv[2], name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        data = text.encode("utf-8")
        with open(path, "wb") as file:
            file.write(gzip.compress(data, 9, mtime=0) if name.endswith(".gz") else data)
    return 0


if __name__ == "__main__":
    sys.exit(main())
