"""Robot files from URDF on the command line: `trajcli urdf`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trajcli.cli.outcome import print_remark, print_text
from trajcli.errors import InputError, Place
from trajcli.job.dump import dump_robot
from trajcli.job.robot import read_urdf, urdf_sheet
from trajcli.streams.whole_file import refuse_overwriting, write_content

if TYPE_CHECKING:
    from trajcli.cli.arm_commands import UrdfCommand


def run_urdf(options: UrdfCommand) -> int:
    """Print or write the robot file of a URDF, and what was decided on the way to it; return the exit code.

    Raises:
        InputError: When the file is no URDF, has no such chain, or would be overwritten.
        FileError: When it cannot be read, or the robot file not written.
    """
    name = "<stdin>" if options.file == "-" else options.file
    try:
        read = read_urdf(
            options.file, root=options.root, tip=options.tip, exact=options.exact, soft=options.soft
        )
    except InputError as error:
        raise error.located(place=Place(name, 1, 1)) from None
    text = dump_robot(urdf_sheet(name, read))
    if options.output in (None, "-"):
        print_text(text.rstrip("\n") + "\n")
    else:
        _write(text, options.file, str(options.output))
    first, *more = read.remarks
    if options.verbose:
        for remark in read.remarks:
            print_remark(f"{name}: {remark}")
    else:
        notes = f"; {len(more)} more note{'s' * (len(more) > 1)}: -v says them" if more else ""
        print_remark(f"{name}: {first}{notes}")
    return 0


def _write(text: str, file: str, output: str) -> None:
    refuse_overwriting([("the robot file", output)], [] if file == "-" else [("the URDF", file)])
    write_content(text.encode(), output)
