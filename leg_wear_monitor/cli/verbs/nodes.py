"""Verbs that run nodes: ``monitor``, ``gait-publisher``, ``demo``, ``dashboard``."""

import asyncio
import json
import os
import signal
import subprocess
import time
import webbrowser
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.cli.start import main as program
from leg_wear_monitor.errors import LegWearError, closed_on_interrupt
from leg_wear_monitor.files import share_directory

if TYPE_CHECKING:
    from leg_wear_monitor.dashboard.live_leg import LiveLeg
    from leg_wear_monitor.dashboard.server import Place


# ``leg-wear-monitor monitor``: the node that follows a real leg.


monitor = common.node_verb(
    "monitor",
    "monitor_node",
    "Run the monitor as a ROS 2 node.",
    """Monitor the joint wear of a leg from joint_states and drive_torque.

    The node monitors as soon as it runs. Parameters: --ros-args --params-file FILE, or -p NAME:=VALUE;
    docs/reference/parameters.md lists them. `ros2 run leg_wear_monitor monitor` starts the same node.
    """,
)


# ``leg-wear-monitor gait-publisher``: the synthetic leg as a node.


gait_publisher = common.node_verb(
    "gait-publisher",
    "gait_publisher",
    "Run the synthetic leg as a ROS 2 node.",
    """Publish the sensor signals of a synthetic leg: joint_states and drive_torque.

    The leg is simulated in full coordinates with its own clearances and wear; noise, loss, load, speed and a
    knocking joint are parameters: --ros-args -p NAME:=VALUE, or --params-file FILE. `ros2 param describe`
    explains them. `ros2 run leg_wear_monitor gait_publisher` starts the same node.
    """,
)


# ``leg-wear-monitor demo``: node and synthetic leg as two processes, recorded, replayed, reported.


DONE = 0
_NAMESPACE = "/demo"
_PATIENCE_S = 60.0
# the end of the walk changes the other topics, because the live monitor then waits for samples
_COMPARED = ("clearance_states", "impact_forces", "predicted_torque")


@click.command(short_help="Run a demonstration of less than a minute.")
@common.option(
    "--out",
    "DIR",
    "Directory for recording, report and logs.",
    type=click.Path(path_type=Path),
    default="leg_wear_demo",
)
def demo(out: Path) -> int:
    """Run the monitor and a synthetic leg as two ROS processes; record, replay and report the run.

    The leg walks, and after a few gait cycles the bushing of its knee, joint G, breaks. The monitor says so.
    Then the recording goes through the same monitor again and gives the same answer.
    """
    common.need_rclpy()
    import_module("leg_wear_monitor.recordings.mcap_file")  # rather than in a node, once both are running
    common.check_directory("--out", out)
    out.mkdir(parents=True, exist_ok=True)
    _compile()
    live = _listen(out)
    _compare_with_truth(out, live)
    same = _replay(out)
    again = json.loads((out / "summary.json").read_text())["verdict"]
    click.echo(f"verdict: live {_headline(live['verdict'])}, replayed {_headline(again)}")
    page = (out / "report.html").resolve()
    click.echo(f"report: {page}")
    if not same or not _headline(live["verdict"]) == _headline(again) == "stop G":
        click.echo("error: the demo failed; see the logs next to the report", err=True)
        return common.WITH_FINDINGS
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(page.as_uri())
    return DONE


def _compile() -> None:
    """Compile the nodes' kernels: the monitor's kernels here, the leg's kernels in a second process."""
    from leg_wear_monitor.dynamics.full_run import advance_full
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.workers import compiled_beside

    with compiled_beside(compile_leg, advance_full):
        common.compile_monitor(MonitorConfig())


def compile_leg() -> None:
    """Compile the kernels of the synthetic leg."""
    from leg_wear_monitor.gait.config import GaitConfig
    from leg_wear_monitor.gait.leg import SyntheticLeg

    SyntheticLeg(GaitConfig()).advance(1.0e-3)


def _listen(out: Path) -> dict[str, Any]:
    """Run the two nodes, print the state of the leg after each gait cycle, and return the last one."""
    from leg_wear_monitor.ros.listeners import DemoListener

    domain = int(os.environ.get("ROS_DOMAIN_ID") or 5 + os.getpid() % 90)
    states: list[dict[str, Any]] = []

    def report(state: dict[str, Any]) -> None:
        if not state["stamp_ns"]:  # before the first gait cycle
            return
        states.append(state)
        clearances = {name: joint["best_estimate_m"] for name, joint in state["clearances"].items()}
        known = "  ".join(f"{name} {1e3 * m:.2f}" for name, m in clearances.items() if m is not None)
        click.echo(
            f"{(state['stamp_ns'] - states[0]['stamp_ns']) / 1e9:6.2f} s  {_headline(state['verdict']):<16}"
            f"clearance [mm]  {known or 'not known'}"
        )

    paths = {"record": out / "live.mcap", "ledger": out / "wear.db", "truth": out / "truth.json"}
    for path in paths.values():
        path.unlink(missing_ok=True)
    click.echo(f"starting the monitor and the leg in ROS domain {domain}")
    demo_listener = DemoListener(_NAMESPACE, domain, report)
    try:
        with (
            _process("monitor", out, domain, record=paths["record"], ledger=paths["ledger"]) as monitor,
            _process("gait-publisher", out, domain, truth=paths["truth"]) as leg,
        ):
            demo_listener.attend(lambda: leg.poll() is None and monitor.poll() is None)
            _check_ended(leg, out / "gait-publisher.log")
    finally:
        demo_listener.leave()
    _check_ended(monitor, out / "monitor.log")
    if not states:
        raise LegWearError(f"{out / 'monitor.log'}: the monitor published no state of the leg")
    return states[-1]


@contextmanager
def _process(verb: str, out: Path, domain: int, **paths: Path) -> "Iterator[subprocess.Popen[bytes]]":
    """A node in its own process; it ends on SIGINT, as from a terminal."""
    from leg_wear_monitor.workers import python_command

    command = python_command(program, verb, "--ros-args", "-r", f"__ns:={_NAMESPACE}")
    command += ["--params-file", str(share_directory() / "config" / "demo.yaml")]
    for name, path in paths.items():
        command += ["-p", f"{name}.path:={path.resolve()}"]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    environment["SKIP_DEFAULT_XML_FILE"] = "1"  # Fast DDS reads a file of settings in the current directory
    with (out / f"{verb}.log").open("wb") as log:
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=subprocess.STDOUT)
        try:
            with closed_on_interrupt(process.terminate):
                yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            try:
                process.wait(_PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()


def _check_ended(process: "subprocess.Popen[bytes]", log: Path) -> None:
    """Raise with the last line of the log if a node did not end in order."""
    if process.returncode not in (None, 0):
        lines = log.read_text(errors="replace").strip().splitlines() or ["nothing"]
        raise LegWearError(f"{log}: the node ended with {process.returncode}: {lines[-1]}")


def _replay(out: Path) -> bool:
    """The recording through the same monitor; whether it gives the same messages."""
    arguments = ["replay", str(out / "live.mcap"), "--out", str(out)]
    arguments += ["--config", str(share_directory() / "config" / "demo.yaml")]
    click.echo(f"leg-wear-monitor {' '.join(arguments)}")
    from leg_wear_monitor.workers import python_command

    done = subprocess.run(python_command(program, *arguments), check=False)
    if done.returncode != DONE:
        raise LegWearError(f"{out / 'live.mcap'}: its replay ended with {done.returncode}")
    live, again = _messages(out / "live.mcap"), _messages(out / "reports.mcap")
    count = sum(map(len, again.values()))
    same = live == again and count > 0
    what = "the same, byte for byte" if same else "not the same"
    click.echo(f"live and replayed: {count} messages on {len(again)} topics, {what}")
    return same


def _messages(path: Path) -> dict[str, list[bytes]]:
    """Messages of the monitor, by topic, in their order."""
    from mcap.reader import make_reader

    found: dict[str, list[bytes]] = defaultdict(list)
    with path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            name = channel.topic.rsplit("/", 1)[-1]
            if name in _COMPARED:
                found[name].append(message.data)
    return dict(found)


def _headline(verdict: dict[str, Any]) -> str:
    return " ".join([verdict["state"].replace("_", " "), *verdict["joints"]])


def _compare_with_truth(out: Path, live: dict[str, Any]) -> None:
    """Print the clearance of the broken joint on the synthetic leg next to the monitor's estimate."""
    from leg_wear_monitor.files import or_nan
    from leg_wear_monitor.monitor.alarms import amount
    from leg_wear_monitor.monitor.verdict.verdict import estimate

    truth: dict[str, Any] = json.loads((out / "truth.json").read_text())
    for joint in live["verdict"]["joints"]:
        known = live["clearances"][joint]
        by_monitor = estimate(or_nan(known["best_estimate_m"]), or_nan(known["best_estimate_sigma_m"]), "m")
        of_leg = amount(truth["clearance_m"][joint][-1], "m")
        click.echo(f"joint {joint}: the clearance is {of_leg} on the leg, {by_monitor} by the monitor")


# ``leg-wear-monitor dashboard``: a live page in a browser, for reading only.


_NODE = "/leg_wear_monitor"


@click.command(short_help="Show a leg live in a browser.")
@common.option(
    "--node", "NAME", "Full name of a running monitor, such as /left/leg_wear_monitor.", default=_NODE
)
@common.config_option
@common.option(
    "--host", "HOST", "Address to listen on; 0.0.0.0 for all addresses of this machine.", default="127.0.0.1"
)
@common.option(
    "--port", "PORT", "Port to listen on; 0 for any free port.", type=click.IntRange(0, 65535), default=8350
)
def dashboard(node: str, config: Path | None, host: str, port: int) -> int:
    """Serve a live page with the verdict, the leg and the trends, until Ctrl-C.

    The page cannot change anything. It has no password, so it is served to this machine only, unless --host
    opens it. Give the parameter file of the monitor with --config, unless it has the default leg.
    """
    import_module("tornado")
    from leg_wear_monitor.dashboard.server import listen

    with _live(node, config) as leg:
        _serve(leg, listen(host, port))
    return 0


@contextmanager
def _live(node: str, config: Path | None) -> Iterator["LiveLeg"]:
    common.need_rclpy()
    from leg_wear_monitor.dashboard.leg_page import leg_setup
    from leg_wear_monitor.dashboard.live_leg import LiveLeg
    from leg_wear_monitor.monitor.config.parameters import load_config
    from leg_wear_monitor.ros.listeners import full_name, listening, topics_of

    name = full_name(node)
    leg = LiveLeg(name, topics_of(name), time.monotonic, leg_setup(load_config(config, name)))
    with listening(name, leg):
        yield leg


def _serve(leg: "LiveLeg", place: "Place") -> None:
    """Serve until a signal."""
    from leg_wear_monitor.dashboard.hub import Hub
    from leg_wear_monitor.dashboard.server import is_local, serve

    def ready(ended: asyncio.Event) -> None:
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, ended.set)
        if not is_local(place.host):
            click.echo(
                f"warning: anyone who reaches {place.host}:{place.port} can read this page: it has no "
                f"password and no encryption",
                err=True,
            )
        waits = leg.freshness()
        if waits.age_s is None:
            click.echo(waits.silence)
        click.echo(f"serving {place.address} (read-only, Ctrl-C ends it)")

    async def run() -> None:
        await serve(Hub(leg), place, ready)

    asyncio.run(run())
