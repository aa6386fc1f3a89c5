"""A directive that shows the table of the keys of a kind of scene, from its schema: ``{keys} sink``."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from scenes.free.tables import BOXES, ON_MESH
from scenes.keys import TYPES
from scenes.schema import Schema


def rows(name: str) -> list[tuple[str, str, str]]:
    """Return key, form and default of every key of "sink", "device", "boxes" or "mesh"."""
    kind = TYPES.get(name)
    schema: Schema = kind.schema if kind else {"boxes": BOXES, "mesh": ON_MESH}[name]
    found = []
    for path, key in schema.paths.items():
        default = key.kind.show(attrgetter(key.attribute)(kind.default)) if kind else ""
        found.append((path, key.kind.form, default))
    for table, kinds in schema.lists.items():
        for key, each in kinds.items():
            found.append((f"[[{table}]] {key}", each.form, "required" if key in schema.required[table] else ""))
    return found


class Keys(SphinxDirective):
    """The directive."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Make the table."""
        heads = ("key", "value", "default")
        table = nodes.table("", group := nodes.tgroup("", cols=3))
        group += [nodes.colspec(colwidth=width) for width in (3, 6, 2)]
        group += [nodes.thead("", self._row(heads)), nodes.tbody("", *map(self._row, rows(self.arguments[0])))]
        return [table]

    @staticmethod
    def _row(cells: tuple[str, ...]) -> nodes.row:
        return nodes.row("", *(nodes.entry("", nodes.paragraph(text=cell)) for cell in cells))


def setup(app: Any) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("keys", Keys)
    return {"parallel_read_safe": True}
