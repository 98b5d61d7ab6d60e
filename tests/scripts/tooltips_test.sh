#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Every control of the viewer's panels says what it does: after each stands a tip(), or it takes one, as
# path_field() does.
set -euo pipefail
cd "$(dirname "$0")/../.."
python3 -B - <<'PY'
import pathlib, re, sys

CONTROL = re.compile(r"ImGui::(?:(?:Button|Checkbox|RadioButton|Combo|BeginCombo|ColorEdit3)\(|(?:Slider|Drag|Input)\w+\(\")|"
                     r"\bedit_vector\(\"")
missing, found = [], 0
for file in sorted(pathlib.Path("viewer/panels").glob("*.cpp")):
    text = file.read_text()
    at = [m.start() for m in CONTROL.finditer(text)]
    for start, end in zip(at, at[1:] + [len(text)]):
        found += 1
        if "tip(" not in text[start:end]:
            missing.append(f"{file}:{text.count(chr(10), 0, start) + 1}: {text[start:start + 50].splitlines()[0]}")
print(f"{found} controls")
for line in missing:
    print("no tip:", line)
sys.exit(1 if missing or found < 40 else 0)
PY
