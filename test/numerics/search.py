"""Search for pairs whose answers break an invariant, among random and adversarial ones.

Run it as ``python test/numerics/search.py --count 1000000 --seed 1``. Every pair is asked three
times: as it is, with A and B exchanged, and with B moved by a nanometre. What is found is printed
and, with ``--keep``, added to counterexamples.jsonl, which the tests read. ``--recheck`` notes
there which of the kept ones are still open. ``--meshes`` looks at those pairs in which triangles
are measured, most of them next to contact.
"""

import argparse
from collections import Counter
import json
from pathlib import Path
import sys

from tqdm import tqdm

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "test" / "support")]

from hard_corpus.adversarial import (  # noqa: E402
    adversarial_cases,
    case_from_text,
    KEPT,
    mesh_cases,
    text_from_case,
    violations,
)

CHUNK = 5000
QUERIES_PER_CASE = 3
SHOWN = 10


def main():
    """Search and report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=100_000, help="queries (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the first pairs (%(default)s)")
    parser.add_argument(
        "--meshes", action="store_true", help="only pairs with meshes measured by triangles"
    )
    parser.add_argument("--keep", action="store_true", help="add what is found to the corpus")
    parser.add_argument("--recheck", action="store_true", help="ask the kept pairs again, only")
    options = parser.parse_args()
    if options.recheck:
        return _recheck()
    pairs = -(-options.count // QUERIES_PER_CASE)
    worst, offenders, queries = {}, {}, 0
    make = mesh_cases if options.meshes else adversarial_cases
    with tqdm(total=pairs, unit=" pairs", disable=None) as bar:
        for k in range(-(-pairs // CHUNK)):
            count = min(CHUNK, pairs - k * CHUNK)
            cases = make(count, options.seed * 100_000 + k)
            found = violations(cases)
            by_label = {case.label: case for case in cases}
            for complaint in found:
                worst.setdefault(complaint.quantity, []).append(complaint)
                offenders.setdefault(complaint.label, (by_label[complaint.label], complaint))
            queries += QUERIES_PER_CASE * count
            bar.update(count)
            bar.set_postfix(faulty=len(offenders))
    _report(queries, pairs, worst, offenders)
    if options.keep:
        _keep(offenders)
    return 1 if offenders else 0


def _report(queries, pairs, worst, offenders):
    """Print how many queries, how many faults of which kind, and the worst of each."""
    print(f"{queries} queries of {pairs} pairs: {len(offenders)} pairs with a fault")
    for quantity, found in sorted(worst.items()):
        found.sort(reverse=True)
        print(f"{quantity}: {len(found)} times, the worst by {found[0].excess:.2g} L")
        for complaint in found[:SHOWN]:
            case, _ = offenders[complaint.label]
            print(f"    {complaint.excess:.2g} L  {complaint.label}  {_names(case)}")
    print("pairs of shapes:", dict(Counter(_names(case) for case, _ in offenders.values())))


def _names(case):
    return f"{case.A.type_name}-{case.B.type_name}"


def _keep(offenders):
    """Append the cases that are not there yet, one line of JSON each."""
    lines = KEPT.read_text().splitlines() if KEPT.exists() else []
    labels = {json.loads(line)["label"] for line in lines}
    for label, (case, complaint) in offenders.items():
        if label not in labels:
            fault = f"{complaint.quantity} by {complaint.excess:.2g} L"
            lines.append(json.dumps({**text_from_case(case), "open": fault}))
    KEPT.write_text("\n".join(lines) + "\n")


def _recheck():
    """Write anew which of the kept cases have a fault, and which."""
    texts = [json.loads(line) for line in KEPT.read_text().splitlines()]
    worst = {}
    for text in texts:
        for complaint in violations([case_from_text(text)])[:1]:
            worst[text["label"]] = f"{complaint.quantity} by {complaint.excess:.2g} L"
    texts = [{**text, "open": worst.get(text["label"])} for text in texts]
    KEPT.write_text("".join(json.dumps(text) + "\n" for text in texts))
    print(f"{len(worst)} of {len(texts)} kept pairs have a fault")
    for label, fault in worst.items():
        print(f"    {label}: {fault}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
