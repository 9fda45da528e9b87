"""The command `trajcli` without its start-up: a process that has imported everything is copied for each call.

A shell finds a small client under the name `trajcli`. It hands its arguments, folder, environment and
standard streams to the process that waits, whose copy runs the entry point of the command, as a process of
its own.
"""

from __future__ import annotations

import atexit
import json
import os
import pkgutil
import select
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from functools import cache
from importlib import import_module
from pathlib import Path

import trajcli
from docs.markdown import ROOT

_CLIENT = """\
#!{python} -ISE
import json, os, socket, sys
call = json.dumps([sys.argv[1:], os.getcwd(), dict(os.environ)]).encode()
with socket.socket(socket.AF_UNIX) as server:
    server.connect({address!r})
    socket.send_fds(server, [len(call).to_bytes(8, "big")], [0, 1, 2])
    server.sendall(call)
    code = server.recv(1)
os._exit(code[0] if code else 70)
"""
_STARTS_WITHIN = 60.0  # seconds
_LIBRARIES = ("matplotlib.backends.backend_svg", "mpl_toolkits.mplot3d", "ruckig", "scipy.optimize", "toppra")
_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # copies of a process have one thread


@cache
def warm_commands() -> Path:
    """Return a folder for the front of PATH, in which `trajcli` is the client of a process that waits.

    The process and the folder last as long as this one.

    Raises:
        RuntimeError: When the process does not start.
    """
    folder = Path(tempfile.mkdtemp(prefix="trajcli-docs-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    address = str(folder / "socket")
    client = folder / "trajcli"
    client.write_text(_CLIENT.format(python=sys.executable, address=address), encoding="utf-8")
    client.chmod(0o755)
    command = [sys.executable, "-m", "docs.warm", address]
    environment = {**os.environ, **_ONE_THREAD}
    server = subprocess.Popen(  # noqa: S603
        command, cwd=ROOT, env=environment, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL
    )
    atexit.register(_end, server)
    _await(Path(address), server)
    return folder


def _end(server: subprocess.Popen[bytes]) -> None:
    server.kill()
    server.wait()


def _await(address: Path, server: subprocess.Popen[bytes]) -> None:
    """Wait until the process listens.

    Raises:
        RuntimeError: When it ends, or does not listen in time.
    """
    latest = time.monotonic() + _STARTS_WITHIN
    while not address.exists():
        if server.poll() is not None or time.monotonic() > latest:
            raise RuntimeError("the process that runs the commands of documents did not start")
        time.sleep(0.01)


def _serve(address: str) -> None:
    names = [module.name for module in pkgutil.walk_packages(trajcli.__path__, "trajcli.")]
    for name in (*_LIBRARIES, *names):
        import_module(name)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(f"{address}.new")
        listener.listen(16)
        Path(f"{address}.new").rename(address)
        while not select.select([listener, sys.stdin], [], [])[0].count(
            sys.stdin
        ):  # closed: its user has gone
            caller, _ = listener.accept()
            if os.fork() == 0:
                listener.close()
                _answer(caller)
            caller.close()
            _collect()
    shutil.rmtree(Path(address).parent, ignore_errors=True)


def _collect() -> None:
    """Let go of copies that have ended."""
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        return


def _answer(caller: socket.socket) -> None:
    """Run one command in a copy of its own, and say its exit code."""
    size, streams, _, _ = socket.recv_fds(caller, 8, 3)
    left = int.from_bytes(size, "big")
    call = b""
    while len(call) < left:
        call += caller.recv(left - len(call))
    command = os.fork()
    if command == 0:
        caller.close()
        _become(streams, *json.loads(call))
    for stream in streams:
        os.close(stream)
    caller.sendall(bytes([os.waitstatus_to_exitcode(os.waitpid(command, 0)[1]) & 255]))
    os._exit(0)


def _become(streams: list[int], arguments: list[str], folder: str, environment: dict[str, str]) -> None:
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["trajcli", *arguments]
    sys.modules["__main__"].__package__ = None  # else the help would name this module as the command
    from trajcli.__main__ import main

    main()


if __name__ == "__main__":
    _serve(sys.argv[1])
