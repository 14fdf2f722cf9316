# SPDX-License-Identifier: GPL-3.0-or-later
"""The type stubs list what the module has, and nothing else."""

import ast
import inspect
import unittest
from pathlib import Path

import lensforge

PACKAGE = Path(lensforge.__file__).parent


def is_public(name):
    return not name.startswith("_") or name in ("__version__", "_repr_png_", "__init__")


def declared():
    """The stubs' public names, and those of every class in them."""
    names, members = set(), {}
    for node in ast.parse((PACKAGE / "__init__.pyi").read_text()).body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names.add(node.name)
        if isinstance(node, ast.ClassDef):
            members[node.name] = {f.name for f in node.body if isinstance(f, ast.FunctionDef)}
        if isinstance(node, ast.AnnAssign):
            names.add(node.target.id)
    return names, members


class Stub(unittest.TestCase):
    def test_lists_all_public_names(self):
        names, _ = declared()
        self.assertEqual(set(lensforge.__all__), names)
        here = {n for n in vars(lensforge) if is_public(n)} - {"__init__"}
        self.assertEqual(here, names)

    def test_lists_all_members_of_classes(self):
        _, members = declared()
        for name in ("Lens", "Setup"):
            own = {n for n in vars(getattr(lensforge, name)) if is_public(n)}
            self.assertEqual(own, members[name], name)

    def test_package_is_marked_as_typed(self):
        self.assertTrue((PACKAGE / "py.typed").exists())

    def test_help_lists_the_options_with_their_limits(self):
        text = inspect.getdoc(lensforge.design)
        self.assertIn("mesh_ratio (float)", text)
        self.assertIn("0.25 to 8", text)
        self.assertNotIn("resume", text)


if __name__ == "__main__":
    unittest.main()
