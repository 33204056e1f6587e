"""The site of `make docs`: pages of this folder, tutorials run, reference made from the package."""

import hashlib
import os
import re
import shutil
import sys
from datetime import date
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path[:0] = [str(HERE / "_site"), str(ROOT / "python")]

import pamrs  # noqa: E402

project = "pamrs"
author = "pamrs developers"
copyright = f"{date.today().year}, {author}"
version = release = pamrs.__version__
REPOSITORY = "https://github.com/pamrs/pamrs"

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_copybutton",
    "made_reference",
    "joined_streams",
]
exclude_patterns = ["_site", "_static"]
root_doc = "index"

# Pages
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4
suppress_warnings = ["myst.header"]  # pages that begin below the level of a title's next one

# Tutorials are run where nothing of them stays, once for each state of the package.
nb_execution_mode = "cache"
nb_execution_in_temp = True
nb_execution_timeout = 240
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_merge_streams = True
nb_output_stderr = "remove"  # progress; an error stops the build
nb_render_markdown_format = "myst"
os.environ["PYTHONPATH"] = os.pathsep.join(
    [str(ROOT / "python"), *filter(None, [os.environ.get("PYTHONPATH")])]
)
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
os.environ.pop("MPLBACKEND", None)  # figures belong to the page
os.environ["NO_COLOR"] = "1"
os.environ["PYDEVD_DISABLE_FILE_VALIDATION"] = "1"


def _state():
    """What the results of tutorials depend on besides their own text."""
    files = sorted(p for p in (ROOT / "python/pamrs").rglob("*") if p.is_file())
    parts = (p.read_bytes() for p in files if "__pycache__" not in p.parts)
    digest = hashlib.sha256()
    for part in parts:
        digest.update(hashlib.sha256(part).digest())
    return digest.hexdigest()[:16]


_RUNS = ROOT / "out" / "docs-runs"
nb_execution_cache_path = str(_RUNS / _state())
for _old in _RUNS.glob("*"):
    if str(_old) != nb_execution_cache_path:
        shutil.rmtree(_old)

# Reference
autosummary_generate = True
autosummary_imported_members = True
autosummary_ignore_module_all = False
autodoc_typehints = "none"
python_maximum_signature_line_length = 88
smartquotes = False  # two dashes are an option
autodoc_member_order = "bysource"
templates_path = ["_site/templates"]
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

# Looks: nothing is asked from another server when a page is read.
html_theme = "furo"
html_title = f"pamrs {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "source_repository": REPOSITORY,
    "source_branch": "main",
    "source_directory": "docs/",
    "top_of_page_buttons": ["view"],
}
copybutton_exclude = ".linenos, .gp, .go"

_LINK = re.compile(r"(\]\()((?:\.\./)+[^)\s]+)\)")


def _links_out_of_the_site(app, docname, source):
    """Links to files of the repository that are no page lead to the repository; the pages of a
    folder with a README are listed below it.
    """
    page = Path(app.env.doc2path(docname))

    def elsewhere(found):
        target, _, anchor = found[2].partition("#")
        path = (page.parent / target).resolve()
        if path.is_relative_to(HERE) or not path.is_relative_to(ROOT):
            return found[0]
        kind = "tree" if path.is_dir() else "blob"
        mark = f"#{anchor}" if anchor else ""
        return f"](<{REPOSITORY}/{kind}/main/{path.relative_to(ROOT).as_posix()}{mark}>)"

    source[0] = _LINK.sub(elsewhere, source[0])
    if page.stem == "README":
        source[0] += "\n```{toctree}\n:hidden:\n:glob:\n\n*\n```\n"


def _public_signature(app, what, name, thing, options, signature, returned):
    """A class that others make has no signature to show."""
    if signature and re.search(r"[(\s]_\w", signature):
        return "", returned
    return None


def setup(app):
    """Called by Sphinx."""
    app.connect("autodoc-process-signature", _public_signature)
    app.connect("source-read", _links_out_of_the_site)
