"""JSON Schemas on the command line: `trajcli schema`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trajcli.job.schema import schema_text
from trajcli.streams.whole_file import write_content

if TYPE_CHECKING:
    from trajcli.cli.file_commands import SchemaCommand


def run_schema(options: SchemaCommand) -> int:
    """Print a schema; return the exit code.

    Raises:
        FileError: When standard output cannot be written.
    """
    write_content(schema_text(options.kind).encode())
    return 0
