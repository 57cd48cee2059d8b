"""How hard, and where: a soft gripper squeezes a ball, and the node says how pressure spreads.

Starts the scene graph node and a simulated gripper that closes until it feels a force, by the
contact surfaces that the node publishes. Prints force, area and pressure for each force, and draws
the scene and the pressure on one pad.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import signal
import sys
import time

from demo import DISCOVERY_SECONDS, isolate, processes, ROOT

PRESSURE_SCALE = 60e3
"""Pascals that are shown in red, by the node and in the picture."""


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--forces", type=float, nargs="+", default=[1.0, 4.0, 9.0, 15.0], metavar="NEWTON",
        help="how hard to squeeze, one after the other",
    )  # fmt: skip
    parser.add_argument("--rate", type=float, default=100.0, help="pose messages per second")
    parser.add_argument("--output", type=Path, default=Path("pressure.png"), help="the picture")
    parser.add_argument("--no-picture", action="store_true", help="only print what happened")
    return parser.parse_args()


def main() -> int:
    """Run the example; return the exit code."""
    arguments = parse_arguments()
    isolate()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    started = time.monotonic()
    from common.gripper import Gripper  # after the environment is set: it starts DDS
    from common.pressure_picture import draw_pressure, Patch, summary

    scene = ROOT / "config" / "scenes" / "gripper.yaml"
    command = [
        *(sys.executable, "-m", "scene_graph_ros.node", "--ros-args"),
        *("-p", f"scene:={scene}", "-p", f"pressure_scale:={PRESSURE_SCALE}"),
        *("--log-level", "warn"),
        *("-p", "shutdown_timeout:=20.0"),  # a busy machine may take its time
    ]
    patches = []
    with processes({"scene graph node": command}) as running, Gripper(arguments.rate) as gripper:
        print("Starting the node and a simulated gripper ...", flush=True)
        what = "the first contact message"
        gripper.wait(lambda: gripper.contacts is not None, what, DISCOVERY_SECONDS)
        print(f"First contact message after {time.monotonic() - started:.1f} s. Squeezing.")
        for force in arguments.forces:
            gripper.squeeze(force)
            patches.append(Patch(gripper.ask_surfaces(), gripper.ask_points(), gripper.opening))
            print(f"  {patches[-1].words()}", flush=True)
        print(summary(patches, gripper.latencies))
        markers = gripper.markers()
    code = running["scene graph node"].returncode
    if code:
        print(f"the node ended with exit code {code}")
    if not arguments.no_picture:
        print("Drawing ...", flush=True)
        draw_pressure(arguments.output, markers, patches, PRESSURE_SCALE)
        print(f"Picture: {arguments.output}")
    return 1 if code else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(128 + signal.SIGINT)
    except (RuntimeError, TimeoutError) as error:
        sys.exit(f"error: {error}")
