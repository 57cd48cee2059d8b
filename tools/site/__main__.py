"""Write the site to build/docs: `python -m tools.site`; fails where a link leads nowhere."""

from __future__ import annotations

import shutil
import sys

from tools.site import reference
from tools.site.places import ROOT
from tools.site.write_site import write_site

_SITE = ROOT / "build" / "docs"


def _main() -> int:
    shutil.rmtree(_SITE, ignore_errors=True)
    reference.keep_annotations()
    dead = write_site(_SITE, reference.modules())
    if dead:
        sys.stderr.write("Links that lead nowhere:\n" + "\n".join(dead) + "\n")
        return 1
    print(f"Open {_SITE / 'index.html'}")
    return 0


if __name__ == "__main__":
    sys.exit(_main())
