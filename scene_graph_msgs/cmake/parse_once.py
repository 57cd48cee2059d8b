"""Run a generator of rosidl that reads interfaces which another one parsed already.

A build runs up to ten generators, and each parses every interface anew, which takes about half of
its time. CMake puts this file in front of their commands:

    python parse_once.py <folder for what was parsed> <python> <generator> <arguments> ...
"""

from collections.abc import Callable
import hashlib
import os
from pathlib import Path
import pickle
import runpy
import sys

from rosidl_parser import definition, parser


def parse_once(folder: Path) -> None:
    """Let the parser of this process keep what it parsed in ``folder``, and look there first."""
    parse: Callable[..., object] = parser.parse_idl_string
    sources = b"".join(Path(m.__file__).read_bytes() for m in (definition, parser))

    def look_or_parse(text: str, png_file: str | None = None) -> object:
        if png_file is not None:  # a picture of the tree is wanted, which is not kept
            return parse(text, png_file=png_file)
        file = folder / hashlib.sha256(sources + text.encode()).hexdigest()
        if file.is_file():
            return pickle.loads(file.read_bytes())  # written below, in the build's own folder
        content = parse(text)
        part = file.with_name(f"{file.name}.{os.getpid()}")
        part.write_bytes(pickle.dumps(content))
        part.replace(file)  # whole or not at all: other generators read meanwhile
        return content

    parser.parse_idl_string = look_or_parse


def main(folder: Path, command: list[str]) -> None:
    """Run a command: a generator in this process, anything else as it is."""
    program, *arguments = command
    is_generator = (
        program == sys.executable
        and bool(arguments)
        and Path(arguments[0]).parent.name.startswith("rosidl_")
    )
    if not is_generator:
        os.execvp(program, command)
    folder.mkdir(parents=True, exist_ok=True)
    parse_once(folder)
    sys.argv = arguments
    sys.path[0] = str(Path(arguments[0]).parent)
    runpy.run_path(arguments[0], run_name="__main__")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
