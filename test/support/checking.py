"""The command that checks files, run in this process, and files for it."""

from scene_graph_ros.check import main

__all__ = ["check", "write"]


def check(capsys, *arguments):
    """Run the command in this process; return exit status, output lines and error lines."""
    status = main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return status, captured.out.splitlines(), captured.err.splitlines()


def write(folder, name, text):
    """Write a file and return its path."""
    (folder / name).write_text(text)
    return folder / name
