"""A process that calls one function of a benchmark module whenever it is asked to, and says how long it took.

It runs in the peers' environment too, where trajcli is not installed. A line with `run` or `numbers` on
standard input is answered with one line of JSON.

Each timed call follows at once on one that does not count. While the others have their turn a virtual machine
may give freed memory back to its host, and fetching it again can take ten times longer than the work itself.
For the same reason it keeps what it frees, whosever function it calls, as the command `trajcli` does.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from importlib import import_module

_REUSED = 1 << 24  # bytes: once such a block was freed, glibc keeps smaller ones for the next arrays


def main(module: str, name: str) -> None:
    """Prepare the function, then answer until the input ends.

    Args:
        module: A benchmark module.
        name: A function of it that returns two functions: the one that is timed, and one that takes its
            result and returns a few of the numbers in it.
    """
    bytes(_REUSED)
    run, numbers = getattr(import_module(module), name)()
    for line in sys.stdin:
        if line.strip() == "numbers":
            answer: float | list[float] = [float(number) for number in numbers(run())]
        else:
            run()
            start = _seconds()
            result = run()
            answer = _seconds() - start
            del result
        print(json.dumps(answer), flush=True)


def _seconds() -> float:
    """Return the time of the processor that this process and its children have taken, s."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


if __name__ == "__main__":
    main(*sys.argv[1:])
