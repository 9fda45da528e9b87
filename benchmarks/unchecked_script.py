"""The rows of a quintic job by trajcli's imports and arithmetic, with no check and no message."""

import gc
import os
import sys
from pathlib import Path
from types import ModuleType

os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", PYDANTIC_DISABLE_PLUGINS="__all__")
gc.set_threshold(100_000, 20, 20)
# as trajcli does: without what pydantic imports to look for plugins
loader = sys.modules["pydantic.plugin._loader"] = ModuleType("pydantic.plugin._loader")
vars(loader)["get_plugins"] = tuple

import numpy as np  # noqa: E402
import typer  # noqa: E402
import yaml  # noqa: E402
from pydantic import BaseModel  # noqa: E402

from trajcli.streams.decimals import encode_fixed  # noqa: E402


class Joints(BaseModel):
    """A state at rest."""

    joints: list[float]


class Move(BaseModel):
    """A move to a state at rest."""

    planner: str
    to: Joints
    duration: float


class Output(BaseModel):
    """The rows that are wanted."""

    rate: float
    columns: list[str]


class Job(BaseModel):
    """What stands in the job."""

    version: int
    robot: dict[str, int]
    limits: dict[str, float]
    start: Joints
    moves: list[Move]
    output: Output


def plan(job: str) -> None:
    """Write the rows of a job of one quintic move."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    read = Job.model_validate(yaml.load(Path(job).read_text(), loader))
    move, count = read.moves[0], len(read.start.joints)
    displacement = np.array(move.to.joints) - np.array(read.start.joints)
    names = ["t", *(f"{kind}{joint + 1}" for kind in ("q", "qd", "qdd") for joint in range(count))]
    out = sys.stdout.buffer
    out.write((",".join(names) + "\n").encode())
    t = np.arange(round(move.duration * read.output.rate) + 1) / read.output.rate
    for block in np.array_split(t, 3):
        u = (block / move.duration)[:, None]
        q = np.array(read.start.joints) + displacement * (((6 * u - 15) * u + 10) * u * u * u)
        qd = displacement / move.duration * (((30 * u - 60) * u + 30) * u * u)
        qdd = displacement / move.duration**2 * (((120 * u - 180) * u + 60) * u)
        out.write(encode_fixed(np.column_stack([block, q, qd, qdd])))
    out.flush()
    os._exit(0)


if __name__ == "__main__":
    application = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    application.command()(plan)
    application()
