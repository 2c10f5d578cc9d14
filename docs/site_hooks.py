"""Additions to MkDocs for the docs site: pages from outside docs/, notebooks as pages, links that stay in the site.

MkDocs calls the functions `on_...`; mkdocs.yml names this file.
"""

import posixpath
import re
import runpy
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
# Pages that stand beside what they describe, at the same path in the site.
OUTSIDE = ("examples/README.md", "examples/ros2_node/README.md", "scenarios/README.md", "embedded/README.md")
LINK = re.compile(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s#]+)(#[^)\s]*)?\)")


def on_files(files: Any, config: Any) -> Any:
    """Adds the pages from outside docs/ and the notebooks, each run once."""
    from mkdocs.structure.files import File

    for name in OUTSIDE:
        text = (ROOT / name).read_text(encoding="utf-8")
        files.append(File.generated(config, name, content=text))
    as_page = runpy.run_path(str(ROOT / "docs" / "run_notebook.py"))["as_page"]
    for notebook in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")):
        files.append(File.generated(config, f"notebooks/{notebook.stem}.md", content=as_page(notebook)))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Turns the repository's links into the site's; a file that is not in the site is named instead of linked."""
    source = page.file.src_uri
    here = posixpath.dirname(source if source in OUTSIDE else f"docs/{source}")

    def in_site(found: re.Match[str]) -> str:
        text, target, anchor = found[1], found[2], found[3] or ""
        if "://" in target or target.startswith("mailto:"):
            return found[0]
        path = posixpath.normpath(posixpath.join(here, target))
        uri = path if path in OUTSIDE else path.removeprefix("docs/").replace(".ipynb", ".md")
        if path in ("README.md", "docs/index.md"):
            uri = "index.md"
        if files.get_file_from_path(uri) is not None and (path.startswith("docs/") or path in (*OUTSIDE, "README.md")):
            return f"[{text}]({posixpath.relpath(uri, posixpath.dirname(source) or '.')}{anchor})"
        if not (ROOT / path).exists():
            return found[0]  # MkDocs names what is broken
        return text if path in text.replace("`", "") else f"{text} (`{path}`)"

    return LINK.sub(in_site, markdown)
