# SPDX-License-Identifier: GPL-3.0-or-later
"""The type stubs list what the module has, and nothing else."""

import ast
import inspect
import pydoc
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
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and is_public(node.name):
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

    def test_functions_have_the_parameters_that_it_lists(self):
        functions = [node for node in ast.parse((PACKAGE / "__init__.pyi").read_text()).body
                     if isinstance(node, ast.FunctionDef)]
        self.assertGreater(len(functions), 10)
        for node in functions:
            given = node.args
            listed = [a.arg for a in given.args + given.kwonlyargs]
            listed += [given.kwarg.arg] if given.kwarg else []
            defaults = [ast.literal_eval(d) for d in given.defaults + given.kw_defaults if d]
            own = inspect.signature(getattr(lensforge, node.name)).parameters.values()
            self.assertEqual([p.name for p in own], listed, node.name)
            self.assertEqual([p.default for p in own if p.default is not p.empty], defaults, node.name)

    def test_help_lists_the_options_with_limits_and_defaults(self):
        text = inspect.getdoc(lensforge.design)
        self.assertRegex(text, r"mesh_ratio \(float\): .*; 0\.25 to 8; default \d")
        self.assertRegex(text, r"threads \(int\): .*; default 0\n")
        self.assertRegex(text, r"focal \(float, mm, or a text with its unit\): .*; default \d")
        self.assertNotIn("resume", text)
        self.assertRegex(inspect.getdoc(lensforge.Setup), r"ior \(float\): .*; default 1\.49")
        self.assertRegex(inspect.getdoc(lensforge.render), r"focal .*; a lens has its own default; above 0, [^;\n]*\n")
        self.assertRegex(inspect.getdoc(lensforge.render), r"device \(str\): .*; default auto")

    def test_help_speaks_of_keywords_and_of_nothing_inside(self):
        for name in set(lensforge.__all__) - {"__version__"}:
            text = pydoc.plain(pydoc.render_doc(getattr(lensforge, name)))
            self.assertNotRegex(text, r"pybind11|PyCapsule|_lensforge| --[a-z]", name)

    def test_wrong_calls_are_refused_without_words_of_what_is_inside(self):
        calls = [
            lambda: lensforge.Lens(),
            lambda: lensforge.Lens(3),
            lambda: lensforge.Setup("8", 8),
            lambda: lensforge.design(),
            lambda: lensforge.render(None),
            lambda: lensforge.export("lens"),
            lambda: lensforge.flux_image(None, None, None),
            lambda: lensforge.nest("lens", "out"),
            lambda: lensforge.design("a.png", progress=3),
        ]
        for call in calls:
            with self.assertRaises(TypeError) as caught:
                call()
            self.assertNotRegex(str(caught.exception), "pybind11|PyCapsule|_lensforge|incompatible")


if __name__ == "__main__":
    unittest.main()
