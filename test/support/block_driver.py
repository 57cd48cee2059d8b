"""Runs a page's blocks of Python in one process, as they come: a line of JSON each.

Answers with a line of JSON: what the block printed, and the traceback where it failed.
"""

from contextlib import redirect_stdout
import io
import json
import sys
import traceback
from types import ModuleType


def main() -> None:
    """Run until there is no other block."""
    answers = sys.stdout
    sys.path[0] = ""  # modules are found in the working folder, as `python` finds them
    # The blocks' own, in place of this file's: without names that a reader does not have.
    sys.modules["__main__"] = reader = ModuleType("__main__")
    for line in sys.stdin:
        block = json.loads(line)
        printed, error = io.StringIO(), ""
        with redirect_stdout(printed):
            try:
                # Lines are numbered as in the page.
                code = compile("\n" * block["line"] + block["text"], block["page"], "exec")
                exec(code, vars(reader))
            except BaseException:  # noqa: BLE001 also what ends a script
                error = traceback.format_exc()
        answer = json.dumps({"printed": printed.getvalue(), "error": error})
        print(answer, file=answers, flush=True)


main()
