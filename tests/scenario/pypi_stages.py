"""Two third-party stage programs, pylablib and thorlabs-apt-device, at one emulated stage each: from before its homing to a reconnection. Their
output is compared with weft-rig's truth and the document's figures (docs/reference/device-facts.md)."""
import time

from pylablib.devices import Thorlabs
from thorlabs_apt_device import KDC101
from thorlabs_apt_device.devices.aptdevice_motor import APTDevice_Motor
from thorlabs_apt_device.enums import EndPoint

# Counts per unit, and per unit/s and unit/s^2 in the controllers' scale; units are mm and degrees.
LTS = (409600, 409600 * 53.68, 409600 * 53.68 * 204.94e-6)
PRM = (1919.6418578623391, *(1919.6418578623391 * 65536 * (2048 / 6e6) ** power for power in (1, 2)))
SPEED, ACCELERATION, STEP = 2, 8, 0.1
JOGGED = (0.2, 4)  # distance in units of 0.3 s of motion, on a machine that may be late
ARRIVED_S = 20
TRUTH_MM = 1.5e-3  # the emulated stage moves in multiples of 1 um


def until(found, what, limit_s=ARRIVED_S):
    end = time.monotonic() + limit_s
    while not found():
        assert time.monotonic() < end, f"{what}: not within {limit_s} s"
        time.sleep(0.02)


class Place:
    """True position of a stage: for x and y by the point of fabric under the probe. The true tilts are not available here: axis None."""

    def __init__(self, t, served, axis):
        self.t, self.served, self.axis = t, served, axis

    def near(self, who, mm):
        if self.axis is not None:
            truth = 1e3 * self.served.order(order="truth")["fabric_point_m"][self.axis]
            self.t.expect(abs(truth - mm) < TRUTH_MM, f"{who}: {mm} mm, in truth {truth} mm")


def pylablib_motor(port, scale):
    return Thorlabs.KinesisMotor(("serial", f"socket://127.0.0.1:{port}"), scale=scale)


class Pylablib:
    """`jog_sign`: direction of "+" on this model, which is direction 2 of the messages."""

    LAST = 4  # units: its final position of the stage

    def __init__(self, t, place, port, identity, scale, jog_sign):
        self.t, self.place, self.identity, self.scale, self.jog_sign = t, place, identity, scale, jog_sign
        self.who = f"pylablib on {identity[1]}"
        self.connect = lambda: pylablib_motor(port, scale)
        self.motor = self.connect()

    def expect(self, fine, what):
        self.t.expect(fine, f"{self.who}: {what}")

    def counts(self):
        return self.motor.get_position(scale=False)

    def at(self, units):
        self.motor.wait_move(timeout=ARRIVED_S)
        self.expect(self.counts() == int(units * self.scale[0]), f"{self.motor.get_position()}, not {units}")
        self.place.near(self.who, units)

    def run(self):
        info = self.motor.get_device_info()
        self.expect((info.serial_no, info.model_no, info.nchannels) == (*self.identity, 1), info)
        self.motor.blink()
        self.expect(not self.motor.is_homed(), "homed before it was")
        self.motor.home(timeout=ARRIVED_S)
        self.expect(set(self.motor.get_status()) == {"connected", "homed", "enabled"}, self.motor.get_status())
        self.at(0)
        given = self.moves()
        self.jogs()
        self.motor.move_to(self.LAST)
        self.motor.close()  # during a move, which continues
        self.motor = self.connect()
        self.at(self.LAST)
        self.expect(self.motor.is_homed() and self.motor.get_velocity_parameters() == given, "what was set is lost with the connection")
        self.motor.close()

    def moves(self):
        given = self.motor.setup_velocity(acceleration=ACCELERATION, max_velocity=SPEED)
        self.expect(abs(given.max_velocity - SPEED) < 1 / self.scale[1], given)
        self.expect(abs(given.acceleration - ACCELERATION) < 1 / self.scale[2], given)
        least_s = 1.5 / SPEED + SPEED / ACCELERATION
        begin = time.monotonic()
        self.motor.move_to(1.5)
        self.at(1.5)
        taken_s = time.monotonic() - begin
        self.expect(0.95 * least_s < taken_s < 3 * least_s, f"{taken_s} s for a move of {least_s} s")
        before = self.counts()
        self.motor.move_by(-1500, scale=False)
        self.motor.wait_move(timeout=ARRIVED_S)
        self.expect(self.counts() == before - 1500, "a relative move")
        self.motor.move_to(2.5)
        self.at(2.5)
        return given

    def jogs(self):
        jog = self.motor.setup_jog(mode="step", step_size=STEP, acceleration=ACCELERATION, max_velocity=SPEED, stop_mode="profiled")
        self.expect((jog.mode, jog.stop_mode) == ("step", "profiled") and abs(jog.step_size - STEP) < 1 / self.scale[0], jog)
        for direction, way in (("+", self.jog_sign), ("-", -self.jog_sign)):
            before = self.counts()
            self.motor.jog(direction, kind="builtin")
            self.motor.wait_move(timeout=ARRIVED_S)
            moved = self.counts() - before
            self.expect(moved == way * int(STEP * self.scale[0]), f"a jog of {moved} counts to {direction}")
            before = self.counts()
            self.motor.jog(direction)
            time.sleep(0.3)
            self.expect(self.motor.is_moving(), f"no motion in {self.motor.get_status()}")
            self.motor.stop(immediate=direction == "-", timeout=ARRIVED_S)
            after = self.counts()
            self.expect(JOGGED[0] < way * (after - before) / self.scale[0] < JOGGED[1], f"{direction} from {before} to {after}")
            time.sleep(0.1)
            self.expect(self.counts() == after, "stopped, and moves")
            self.place.near(self.who, after / self.scale[0])


def lts(path, home):
    """The library has no class for an LTS; this is its general one, set to a unit with one channel."""
    return APTDevice_Motor(serial_port=path, home=home, controller=EndPoint.USB, bays=(EndPoint.USB,), status_updates="polled")


def kdc(path, home):
    return KDC101(serial_port=path, home=home)


class ThorlabsAptDevice:
    """Its orders are queued, and another thread polls its status every 10 ms. On both models "forward" counts up."""

    LAST = 1

    def __init__(self, t, place, make, path, scale):
        self.t, self.place, self.scale = t, place, scale
        self.who = f"thorlabs-apt-device, {make.__name__}"
        self.connect = lambda home: make(path, home)

    def open(self, home):
        self.device = self.connect(home)
        self.seen = self.device.status_[0][0]

    def close(self):
        self.device.close()
        self.device._thread.join(10)  # it closes its port after close() has returned

    def until(self, found, what):
        until(found, f"{self.who}: {what}")

    def rest(self):
        """Position of the stage at rest: no motion, and the same position for 0.2 s."""
        def stands():
            before = self.seen["position"]
            time.sleep(0.2)
            return self.seen["position"] == before and not any(
                self.seen[key] for key in ("moving_forward", "moving_reverse", "jogging_forward", "jogging_reverse"))

        self.until(stands, "rest")
        self.place.near(self.who, self.seen["position"] / self.scale[0])
        return self.seen["position"]

    def at(self, counts):
        self.until(lambda: self.seen["position"] == counts, f"{counts} counts")
        self.t.expect(self.rest() == counts, f"{self.who}: {self.seen['position']} counts, not {counts}")

    def given_back(self, table, values):
        self.until(lambda: values.items() <= getattr(self.device, table)[0][0].items(), f"{values} given back")

    def run(self):
        self.open(home=True)
        self.until(lambda: self.seen["homed"] and not self.seen["homing"], "homing")
        self.at(0)
        self.t.expect(self.seen["motor_connected"] and self.seen["channel_enabled"] and not self.seen["error"], f"{self.who}: {self.seen}")
        velocity = {"acceleration": round(ACCELERATION * self.scale[2]), "max_velocity": round(SPEED * self.scale[1])}
        self.device.set_velocity_params(**velocity)
        self.given_back("velparams_", velocity)
        unit = round(self.scale[0])
        self.moves(unit)
        self.jogs(velocity)
        self.device.move_absolute(self.LAST * unit)
        self.at(self.LAST * unit)
        for enabled in (False, True):
            self.device.set_enabled(enabled)
            self.until(lambda: self.seen["channel_enabled"] == enabled, f"enabled: {enabled}")
        self.device.identify(None)
        self.close()
        self.open(home=False)
        self.given_back("velparams_", velocity)
        self.until(lambda: self.seen["homed"], "homed after reconnecting")
        self.at(self.LAST * unit)
        self.close()

    def moves(self, unit):
        self.device.move_absolute(2 * unit)
        self.at(2 * unit)
        self.device.move_absolute(unit, now=False)  # the position as a parameter, and then the message without one
        self.device.move_absolute()
        self.at(unit)
        self.device.move_relative(unit // 2)
        self.at(unit + unit // 2)

    def jogs(self, velocity):
        jog = {"step_size": round(STEP * self.scale[0]), **velocity}
        self.device.set_jog_params(jog["step_size"], **velocity)
        self.given_back("jogparams_", jog)
        for direction, way in (("forward", 1), ("reverse", -1)):
            start = self.seen["position"]
            self.device.move_jog(direction)
            self.at(start + way * jog["step_size"])
            start = self.seen["position"]
            self.device.move_velocity(direction)
            time.sleep(0.3)
            self.device.stop(immediate=direction == "reverse")
            moved = way * (self.rest() - start) / self.scale[0]
            self.t.expect(JOGGED[0] < moved < JOGGED[1], f"{self.who}: {direction} by {moved}")
