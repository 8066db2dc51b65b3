"""Node ``leg_wear_monitor``: passes samples from topics to the monitor, and publishes its reports."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.subscription import Subscription
from std_srvs.srv import Trigger

from leg_wear_monitor.dynamics.clearance.stepper import advance_beside
from leg_wear_monitor.errors import LegWearError, closed_on_interrupt
from leg_wear_monitor.mechanism.loader import doubts, load_mechanism
from leg_wear_monitor.monitor.alarms import ADVICE
from leg_wear_monitor.monitor.config.fitting import check_limits, parameter_doubts
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.operator_actions import alarm_words, wear_words
from leg_wear_monitor.monitor.reports import DIAGNOSTICS_PERIOD_S, Reports
from leg_wear_monitor.monitor.wear_monitor import WearMonitor, open_monitor
from leg_wear_monitor.recordings import outputs
from leg_wear_monitor.recordings.cdr import Decoder
from leg_wear_monitor.recordings.outputs import Messages
from leg_wear_monitor.recordings.streams import SENSOR_DATA, STREAMS
from leg_wear_monitor.ros.health import Clocks, Load, load_status, recording_status
from leg_wear_monitor.ros.inputs import Inbox, Inputs, check_stamps
from leg_wear_monitor.ros.measure import measured, not_stored, offer_measure, with_storage
from leg_wear_monitor.ros.outputs import BlackBox, MarkerTopic, Outlets
from leg_wear_monitor.ros.parameters import Parameters
from leg_wear_monitor.ros.running import ClosingNode, release_memory, repeated, run, spin
from leg_wear_monitor.ros.supervision import Supervision

_BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


def boot_id() -> str:
    """Identifier of the computer's current boot; empty if unknown."""
    try:
        return _BOOT_ID.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""


# The time of the operators' actions.


def audit_time(now_ns: int) -> int:
    """Time for permanent audit records [ns].

    Raises
    ------
    LegWearError
        If no valid time is available.
    """
    if now_ns <= 0:
        raise LegWearError(
            "the ledger has no time: use_sim_time is set and no message came on /clock; "
            "publish /clock or start the node without use_sim_time"
        )
    return now_ns


NO_COMMANDS = "It publishes no commands and must not be part of a safety function."

# Period of taking and processing messages. Each turn costs processor time: a period of 5 ms would take 4 %
# more of a core and report 25 ms earlier.
_TAKE_S = 0.05
# Period at which a thread takes messages as well. A reference keeps the node busy for up to ten seconds on
# the leg's computer, and the middleware holds five seconds at 1 kHz.
_RECEIVE_S = 1.0
_RELEASE_S = 10.0  # period at which free memory is given back, in 0.2 ms
_AT_ONCE = 500  # messages at once, so that services and parameters are also served
_HELD = 20_000  # capacity in messages: ten seconds at 1 kHz on both topics
_A_SAMPLE = (outputs.TORQUE, outputs.IMPACTS)


class MonitorNode(ClosingNode):
    """The live monitor node."""

    _inputs: Inputs | None = None

    def __init__(self, **options: Any) -> None:
        super().__init__("leg_wear_monitor", **options)
        self.get_logger().info(f"{ADVICE} {NO_COMMANDS}")
        namespace = self.get_namespace().strip("/")
        parameters = Parameters(self, MonitorConfig, empty={"hardware_id": namespace or "leg"})
        self._is_simulated = bool(self.get_parameter("use_sim_time").value)
        if self._is_simulated:
            check_stamps(parameters.config, self.get_fully_qualified_name())
        log = self.get_logger()
        log.info("preparing: the first start compiles numerical kernels (half a minute on two processors)")
        with repeated(lambda passed_s: log.info(f"preparing: {passed_s:.0f} s")), advance_beside():
            self._open(parameters)

    def _open(self, parameters: Parameters[MonitorConfig]) -> None:
        """Open the ledger and set up everything else; close the ledger if that fails."""
        config = parameters.config
        kept, log = Path(config.ledger.path).absolute(), self.get_logger()
        ledger = f"ledger {kept} is {'continued' if kept.exists() else 'new'}"
        self._monitor = open_monitor(load_mechanism(config.mechanism), config)
        log.info(
            ledger
            if config.ledger.path
            else "no ledger, because ledger.path is empty: the wear is lost when the monitor ends"
        )
        self._monitor.go_live()
        # until `close`: a signal may arrive before the caller of the constructor holds this node
        self._in_order = ExitStack()
        self._in_order.enter_context(closed_on_interrupt(self._monitor.close))
        try:
            self._get_ready(parameters)
        except BaseException:  # signals included: the next start must not consider the ledger truncated
            with self._in_order:  # independent of the state of the ledger
                self._monitor.close()
            raise

    def _get_ready(self, parameters: Parameters[MonitorConfig]) -> None:
        """Set up everything after the ledger is open, and log when the node is ready."""
        config = parameters.config
        decoder = Decoder(config)
        self._inbox = Inbox(decoder, _HELD)
        self._load = Load()
        self._clocks = Clocks(self._monitor, boot_id())
        self._messages = Messages(config, self._monitor.clearance_joints, self.get_fully_qualified_name())
        self._black_box = BlackBox(config.record.path, self.get_logger().info)
        self._outlets = Outlets(self, outputs.OUTPUTS, self._black_box)
        self._compile(decoder)
        mechanism = self._monitor.mechanism
        parameters.follow(
            self, self._configure, lambda config: check_limits(config, mechanism, self.get_name())
        )
        self._serve()
        self._supervision = Supervision(self, self._monitor, config)
        self._markers = MarkerTopic(self._outlets, self._monitor)
        self._send_state()
        inputs = self._inputs = Inputs(self, config)
        self._supervision.inputs = inputs.topics
        for topic in self._supervision.inputs:
            self._black_box.add_topic(topic.name, topic.stream.type, SENSOR_DATA)
        # work and diagnostics continue while simulation time stands still
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(_TAKE_S, partial(self._take, inputs), clock=steady)
        self.create_timer(DIAGNOSTICS_PERIOD_S, self._diagnose, clock=steady)
        self.create_timer(_RELEASE_S, release_memory, clock=steady)
        self._in_order.enter_context(repeated(lambda _: self._receive(inputs), _RECEIVE_S))
        joints, leg = ", ".join(self._monitor.clearance_joints), self._monitor.mechanism.name
        rpm = f"{config.cadence.commanded_rpm:g} rpm"
        self.get_logger().info(f"monitoring joints {joints} of {leg} at {rpm}, hardware {config.hardware}")
        found = doubts(load_mechanism(config.mechanism)), parameter_doubts(config, mechanism)
        for doubt in chain(*found, self._monitor.coefficient_doubts):
            self.get_logger().warning(str(doubt))

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """Subscriptions that an executor serves; a timer takes the inputs."""
        own = self._inputs.subscriptions if self._inputs else ()
        return (one for one in super().subscriptions if one not in own)

    @property
    def monitor(self) -> WearMonitor:
        """The monitor that processes the samples."""
        return self._monitor

    def close(self) -> None:
        """Process the received messages, save the ledger, finish the recording."""
        try:
            while len(self._inbox):
                self._work()
        finally:
            with closing(self._black_box), self._in_order:  # in any state of the ledger
                self._monitor.close()

    def _compile(self, decoder: Decoder) -> None:
        """Compile the kernels before the first sample."""
        self.get_logger().info("preparing: setting up the leg")
        self._monitor.warm_up()
        for stream in STREAMS:
            decoder.one(b"", stream.code)
        release_memory()

    # --- inputs ---

    def _ros_now_ns(self) -> int:
        """Present ROS time [ns]."""
        return self.get_clock().now().nanoseconds

    def _take(self, inputs: Inputs) -> None:
        """Take the messages that came, and process them, for no longer than until the next turn."""
        now_ns = self._turn()
        self._receive(inputs)
        while len(self._inbox) and time.monotonic_ns() < now_ns + _TAKE_S * 1.0e9:
            self._work()

    def _receive(self, inputs: Inputs) -> None:
        """Put the messages that came into the inbox."""
        with self._inbox.lock:
            arrivals = inputs.taken(time.time_ns())
            for one in arrivals:
                self._inbox.add(one.code, one.raw, one.log_time_ns)
        last, now_ns = {one.code: one for one in arrivals}, time.monotonic_ns()
        for topic in inputs.topics:
            if topic.stream.code in last:
                newest = last[topic.stream.code]
                topic.heard_ns, topic.heard_wall_ns = now_ns, newest.log_time_ns

    def _turn(self) -> int:
        """Current time [ns] on a monotonic clock; a late node does not count as a silent input."""
        now_ns = time.monotonic_ns()
        if late_ns := self._load.late_ns(now_ns):
            self._supervision.excuse(late_ns)
        return now_ns

    def _work(self) -> None:
        """Process received messages, a bounded number at a time."""
        coarse = self._load.note(self._inbox.delay_s(time.time_ns()))
        arrivals = self._inbox.take(_AT_ONCE)
        if self._black_box.on:
            names = {topic.stream.code: topic.name for topic in self._supervision.inputs}
            for arrival in arrivals:
                row = np.frombuffer(arrival.raw, np.uint8)[None, :]
                self._black_box.write(names[arrival.code], arrival.log_time_ns, row)
        samples = self._inbox.decoded(arrivals)
        self._clocks.check(samples, self._ros_now_ns())
        self._monitor.note_late(self._load.is_late(time.monotonic_ns()))
        reports = self._monitor.update(samples)
        self._supervision.note(arrivals, samples)
        self._publish(reports, coarse)

    # --- outputs ---

    def _publish(self, reports: Reports, coarse: bool) -> None:
        now_ns = time.time_ns()
        self._markers.publish(reports)
        reports = attrs.evolve(
            reports,
            alarms=tuple(map(self._supervision.alarms, reports.alarms)),
            verdicts=tuple(map(self._supervision.verdict, reports.verdicts)),
            states=tuple(map(self._supervision.state, reports.states)),
        )
        for outgoing in self._messages.of(reports):
            if coarse and outgoing.output in _A_SAMPLE and not self._black_box.on:
                self._load.unpublished += len(outgoing.stamp_ns)
            elif self._outlets.wanted(outgoing.output):
                self._outlets.send(outgoing, now_ns)
        for forecast in self._messages.forecasts(reports):
            self._outlets.send(forecast, now_ns)

    def _send_state(self) -> None:
        """Publish the present alarms, verdict and state of the leg."""
        alarms = self._supervision.alarms(self._monitor.alarms)
        report = self._supervision.state(self._monitor.state_report)
        messages = self._messages
        for outgoing in (messages.alarms(alarms), messages.verdict(report), messages.state(report)):
            self._outlets.send(outgoing, time.time_ns())

    def _diagnose(self) -> None:
        now_ns, turn_ns = time.time_ns(), self._turn()
        self._load.note_lost(sum(topic.lost for topic in self._supervision.inputs), turn_ns)
        if self._supervision.check():
            self._send_state()
        status = (
            *self._monitor.status(),
            load_status(self._load, self._inbox, self._black_box.on),
            recording_status(self._black_box),
            self._clocks.status(self._ros_now_ns(), turn_ns, self._is_simulated),
        )
        message = self._messages.diagnostics(self._ros_now_ns(), self._supervision.statuses(status))
        self._outlets.send(message, now_ns)
        self._black_box.flush()

    # --- operators ---

    def _configure(self, config: MonitorConfig) -> None:
        self._monitor.configure(config)
        self._messages.config = config

    def _serve(self) -> None:
        self._offer("~/acknowledge_alarms", self._acknowledge)
        self._offer("~/save_state", self._save)
        for joint in self._monitor.clearance_joints:
            self._offer(f"~/reset_wear/{joint}", partial(self._reset_wear, joint))
            self._offer(f"~/undo_reset/{joint}", partial(self._undo_reset, joint))
        offer_measure(self, self._measure)

    def _offer(self, name: str, act: Callable[[], str]) -> None:
        """Create a service that performs an action and returns its result or error in one line."""

        def answer(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            try:
                response.success, response.message = True, act()
            except LegWearError as error:
                response.success, response.message = False, str(error)
            self.get_logger().info(f"{name}: {response.message}")
            return response

        self.create_service(Trigger, name, answer)

    def _acknowledge(self) -> str:
        cleared, kept = self._monitor.acknowledge(self._ros_now_ns())
        own_cleared, own_kept = self._supervision.acknowledge()
        self._markers.forget()
        cleared, kept = (*cleared, *own_cleared), (*kept, *own_kept)
        self._send_state()
        return with_storage(alarm_words(cleared, kept), not_stored(self._monitor))

    def _save(self) -> str:
        self._monitor.save()
        return f"saved in {self._monitor.config.ledger.path}"

    def _measure(self, wanted: dict[str, Any]) -> str:
        text = measured(self._monitor, wanted, audit_time(self._ros_now_ns()))
        self._markers.forget()
        self._send_state_and_forecast()
        return text

    def _send_state_and_forecast(self) -> None:
        """Publish an operator's changes, because a leg at rest has no gait cycle that would publish them."""
        self._send_state()
        if last := self._monitor.last_cycle:
            self._outlets.send(self._messages.forecast(last), time.time_ns())

    def _reset_wear(self, joint: str) -> str:
        stamp_ns = audit_time(self._ros_now_ns())
        was = wear_words(self._monitor.wear_of(joint))
        alarms = alarm_words(*self._monitor.reset_wear(joint, stamp_ns, "service ~/reset_wear"))
        self._send_state_and_forecast()
        fault = not_stored(self._monitor)
        history = "" if fault else f", history kept; ~/undo_reset/{joint} reverts this"
        reply = f"joint {joint}: new surfaces, {was} set to 0{history}; alarms {alarms}"
        return with_storage(f"{reply}; let the leg walk to confirm the repair", fault)

    def _undo_reset(self, joint: str) -> str:
        stamp_ns = audit_time(self._ros_now_ns())
        wear = wear_words(self._monitor.undo_reset(joint, stamp_ns, "service ~/undo_reset"))
        self._send_state_and_forecast()
        reply = f"joint {joint}: the reset is undone, the wear is again {wear}"
        return with_storage(f"{reply}, including the wear since the reset", not_stored(self._monitor))


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point of ``ros2 run leg_wear_monitor monitor``; returns the exit code."""
    return run(MonitorNode, spin, argv)
