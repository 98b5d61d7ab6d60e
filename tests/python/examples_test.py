#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The examples in tiny form: each ends, prints figures and writes a picture."""

import importlib.util
import pathlib
import subprocess
import sys
import tempfile
import unittest

import support

try:
    import numpy as np

    import darb
except ModuleNotFoundError as error:  # one that is there and does not load fails the test
    support.skip(f"the module is not here: {error}")

EXAMPLES = support.SOURCE / "tools" / "python" / "examples"
EXCEPTIONS = ("Error", "NoRoom", "DeviceLost")


class Examples(unittest.TestCase):
    def run_example(self, name, *words):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, str(EXAMPLES / f"{name}.py"), "-o", folder, *words],
                                  text=True, capture_output=True, timeout=300, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            picture = (pathlib.Path(folder) / f"{name}.png").read_bytes()
            self.assertGreater(len(picture), 1000)
            return done.stdout

    def test_fit_picture(self):
        said = self.run_example("fit_picture", "--splats", "40", "--steps", "25", "--size", "48")
        figures = [float(line.split(" dB ")[0].split()[-1]) for line in said.splitlines() if " dB " in line]
        self.assertEqual(len(figures), 3, said)
        self.assertGreater(min(figures), 14)

    @unittest.skipIf(importlib.util.find_spec("torch") is None, "torch is not here")
    def test_fit_gsplat(self):
        said = self.run_example("fit_gsplat", "--splats", "60", "--steps", "30", "--size", "48")
        first, last = (float(part.split()[-1]) for part in said.split(" dB ")[:2])
        self.assertGreater(last, first + 5, said)

    def test_compare_gradients(self):
        said = self.run_example("compare_gradients", "--size", "48", "--points", "17")
        self.assertEqual(said.count("off the loss by"), 5, said)

    @unittest.skipUnless(support.SHIPPED.exists(), "the shipped scene is not in the tree")
    def test_train_own_loss(self):
        said = self.run_example("train_own_loss", "--iterations", "20", "--resolution", "32")
        self.assertIn("charbonnier: ", said)

    def test_what_the_stubs_name_is_there(self):
        import ast
        tree = ast.parse((pathlib.Path(darb.__file__).parent / "__init__.pyi").read_text())
        names = [node.name for node in tree.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))]
        for name in names:
            if name == "Info":
                continue
            self.assertTrue(hasattr(darb, name), name)
            self.assertTrue(getattr(darb, name).__doc__, f"{name} has no docstring")
        self.assertEqual(sorted(set(darb.__all__) - {"__version__"}), sorted(set(names) - {"Info"}))
        for node in tree.body:
            if isinstance(node, ast.FunctionDef):
                import inspect
                mine = list(inspect.signature(getattr(darb, node.name)).parameters)
                theirs = [a.arg for a in node.args.args + node.args.kwonlyargs]
                self.assertEqual(mine, theirs, node.name)
            elif isinstance(node, ast.ClassDef) and node.name not in EXCEPTIONS + ("Info",):
                for part in node.body:
                    if isinstance(part, ast.FunctionDef):
                        self.documented(node.name, part.name)

    def test_what_is_there_is_in_the_stubs(self):
        import ast
        folder = pathlib.Path(darb.__file__).parent
        tree = ast.parse((folder / "__init__.pyi").read_text())
        for node in tree.body:
            if not isinstance(node, ast.ClassDef) or node.name in EXCEPTIONS + ("Info",):
                continue
            named = {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
            named |= {part.target.id for part in node.body if isinstance(part, ast.AnnAssign)}
            there = {name for name in dir(getattr(darb, node.name)) if not name.startswith("_")}
            self.assertEqual(there - named, set(), node.name)

    def test_the_stub_of_torch_has_its_signature(self):
        import ast
        folder = pathlib.Path(darb.__file__).parent

        def arguments(name):
            for node in ast.parse((folder / name).read_text()).body:
                if isinstance(node, ast.FunctionDef) and node.name == "rasterize":
                    return [a.arg for a in node.args.args + node.args.kwonlyargs]
            return None

        self.assertEqual(arguments("torch.pyi"), arguments("torch.py"))
        inputs = set(arguments("__init__.pyi"))
        self.assertEqual(inputs, set(arguments("torch.pyi")))

    def documented(self, kind, name):
        member = getattr(getattr(darb, kind), name, None)
        self.assertIsNotNone(member, f"{kind}.{name}")
        if name.startswith("_"):
            return
        # pybind11 begins with the signature.
        said = [line for line in (member.__doc__ or "").splitlines() if not line.startswith(f"{name}(")]
        self.assertTrue("".join(said).strip(), f"{kind}.{name} has no docstring")


if __name__ == "__main__":
    unittest.main(verbosity=1)
