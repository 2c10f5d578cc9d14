"""Runs a notebook's cells in order and writes it as a page: its text, its code, and what each cell shows.

    python docs/run_notebook.py docs/notebooks/first_answer.ipynb

The notebooks in docs/notebooks are kept without outputs, so that a change shows as a change. The site and the tests run
them here: plain Python in one namespace, a cell's last expression shown as Jupyter would, as HTML where there is one.
"""

import ast
import base64
import contextlib
import html
import io
import json
import os
import re
import sys
import tempfile
from pathlib import Path
from typing import Any


def cells(notebook: Path) -> list[tuple[str, str]]:
    """Kind ("markdown" or "code") and source of each cell."""
    given = json.loads(notebook.read_text(encoding="utf-8"))
    return [(cell["cell_type"], "".join(cell["source"])) for cell in given["cells"]]


def run_cell(source: str, namespace: dict[str, Any]) -> tuple[str, Any]:
    """Printed text, and the value of the last expression, else None."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "cell", "exec"), namespace)
        value = eval(compile(ast.Expression(last.value), "cell", "eval"), namespace) if last else None
    return printed.getvalue(), value


def shown(printed: str, value: Any) -> str:
    """Text, pictures and value as a page has them."""
    parts = [f"<pre>{html.escape(printed.rstrip())}</pre>"] if printed.strip() else []
    parts += _pictures()
    if hasattr(value, "_repr_html_"):
        # pymdownx leaves HTML alone as long as no blank line ends the block.
        parts.append(re.sub(r"\n\s*\n", "\n", value._repr_html_()))
    elif value is not None:
        parts.append(f"<pre>{html.escape(repr(value))}</pre>")
    return f'<div class="notebook-output">{"".join(parts)}</div>\n' if parts else ""


def _pictures() -> list[str]:
    """The figures that pyplot holds, which it then forgets, as Jupyter does after each cell."""
    if "matplotlib.pyplot" not in sys.modules:
        return []
    import matplotlib.pyplot as plt

    pictures = []
    for number in plt.get_fignums():
        image = io.BytesIO()
        plt.figure(number).savefig(image, format="png", dpi=110)
        pictures.append(f'<img alt="" src="data:image/png;base64,{base64.b64encode(image.getvalue()).decode()}">')
    plt.close("all")
    return pictures


def as_page(notebook: Path) -> str:
    """The notebook as Markdown, run in an empty folder.

    Raises:
        Exception: whatever a cell raises.
    """
    os.environ["MPLBACKEND"] = "agg"
    namespace: dict[str, Any] = {"__name__": "__main__"}
    page, given = [], cells(notebook)
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for kind, source in given:
            if kind == "markdown":
                page.append(source + "\n")
            else:
                page.append(f"```python\n{source}\n```\n\n" + shown(*run_cell(source, namespace)))
    return "\n".join(page)


if __name__ == "__main__":
    print(as_page(Path(sys.argv[1])))
