"""The main job on real input: a Panda at work in a cell, watched for contacts.

Starts three processes that talk over DDS on this machine only: the scene graph node, a simulated
Panda that publishes its joint positions, and a tracker of free objects that publishes their poses.
Listens to what the node publishes, says where a browser shows it meanwhile, prints what happened
and draws it, and what a camera on the wrist saw.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import contextlib
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

ROOT = Path(__file__).resolve().parent.parent
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
DISCOVERY_SECONDS = 60.0
STOP_SECONDS = 10.0
SAMPLES = 12
"""Of each pixel of the picture, which takes 1.3 s of one core for each."""


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10.0, help="how long to run")
    parser.add_argument("--rate", type=float, default=100.0, help="pose messages per second")
    parser.add_argument("--output", type=Path, default=Path("demo.png"), help="the picture")
    parser.add_argument("--no-picture", action="store_true", help="only print what happened")
    parser.add_argument(
        "--scene",
        type=Path,
        default=ROOT / "config" / "scenes" / "panda_cell.yaml",
        help="scene file",
    )
    return parser.parse_args()


def isolate() -> None:
    """Keep the topics on this machine and in a domain of their own, unless told otherwise.

    And out of Fast DDS's shared memory, which delays messages now and then: see docs/messages.md.
    """
    is_local = os.environ.get(RANGE, "LOCALHOST") == "LOCALHOST"
    if is_local and PROFILES not in os.environ:
        os.environ[RANGE] = "SYSTEM_DEFAULT"
        os.environ[PROFILES] = str(ROOT / "config" / "udp_on_this_machine.xml")
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))


@contextlib.contextmanager
def processes(commands: dict[str, list[str]]) -> Iterator[dict[str, subprocess.Popen]]:
    """Run the commands side by side; interrupt them at the end, and kill what does not stop."""
    running = {name: subprocess.Popen(command, cwd=ROOT) for name, command in commands.items()}
    try:
        yield running
    finally:
        for process in running.values():
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for name, process in running.items():
            try:
                process.wait(STOP_SECONDS)
            except subprocess.TimeoutExpired:
                print(f"{name} did not stop within {STOP_SECONDS:g} s and was killed")
                process.kill()
                process.wait()


def make_ready() -> None:
    """Compile the kernels of cameras, once: else the node would do it beside the demo."""
    from scene_graph_ros.geometry.compiled.readiness import is_ready

    if not is_ready("cameras"):
        subprocess.run([sys.executable, "-m", "scene_graph_ros.warmup", "cameras"], check=True)


def main() -> int:
    """Run the demo; return the exit code."""
    arguments = parse_arguments()
    make_ready()
    isolate()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    started = time.monotonic()
    from common.demo_monitor import Monitor, summary  # after the environment is set: it starts DDS

    python = sys.executable
    commands = {
        "scene graph node": [
            *(python, "-m", "scene_graph_ros.node", "--ros-args"),
            *("-p", f"scene:={arguments.scene.resolve()}", "--log-level", "warn"),
            *("-p", "browser:=true", "-p", "browser_port:=0"),  # a free one, which it tells
            *("-p", "browser_token:=new"),  # nobody else on this machine may look
            *("-p", "shutdown_timeout:=20.0"),  # a busy machine may take its time
        ],
        "Panda": [python, "examples/panda_robot.py", "--rate", str(arguments.rate)],
        "moving objects": [python, "examples/moving_objects.py", "--rate", str(arguments.rate)],
    }
    with processes(commands) as running, Monitor() as monitor:
        print("Starting the node, a simulated Panda and a tracker of objects ...", flush=True)
        while not (monitor.has_contacts() and monitor.page()):
            monitor.spin(0.1)
            for name, process in running.items():
                if process.poll() is not None:
                    print(f"{name} ended early with exit code {process.returncode}")
                    return 1
            if time.monotonic() - started > DISCOVERY_SECONDS:
                missing = "page" if monitor.has_contacts() else "contact message"
                print(f"no {missing} came within {DISCOVERY_SECONDS:g} s")
                return 1
        print(f"Contacts come after {time.monotonic() - started:.1f} s.")
        print(f"In a browser, while this runs: file://{monitor.page()}", flush=True)
        monitor.watch(arguments.seconds, node_pid=running["scene graph node"].pid)
        answers = monitor.ask()
    print(summary(monitor, answers))
    failed = {name: p.returncode for name, p in running.items() if p.returncode != 0}
    for name, code in failed.items():
        print(f"{name} ended with exit code {code}")
    if not arguments.no_picture:
        from common.picture import Camera, draw_scene

        print("Drawing the moment with the most contacts ...", flush=True)
        camera = Camera(eye=(2.45, -1.55, 1.75), target=(0.25, 0.2, 0.62))
        markers, contacts = monitor.best_moment()
        draw_scene(arguments.output, markers, contacts.points, camera, SAMPLES)
        print(f"Picture: {arguments.output}")
        if monitor.camera.best is not None:
            from common.camera_images import draw_view

            seen = arguments.output.with_stem(f"{arguments.output.stem}_camera")
            draw_view(seen, monitor.camera.best)
            print(f"What the wrist's camera saw: {seen}")
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(128 + signal.SIGINT)
