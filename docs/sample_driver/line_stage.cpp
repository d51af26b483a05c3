// Driver of a linear stage that accepts lines of text: "*IDN?", "EN 1", "ACC mm/s2", "VEL mm/s",
// "HOME", "MOV mm", "STOP" (with its ramp), "ABORT" (at once). The reply to "STAT?" is
// "STAT mm MOVING HOMED LIMIT ERROR", to "*IDN?" "MAKER,MODEL,SERIAL,FIRMWARE". Other lines have
// no reply.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "drivers/api/config.hpp"
#include "drivers/api/driver_base.hpp"
#include "drivers/api/plugin.hpp"
#include "drivers/api/timer.hpp"

namespace {
using namespace weft;

constexpr Duration reply_limit = std::chrono::seconds(1),
                   poll_period = std::chrono::milliseconds(50);
constexpr Duration home_limit = std::chrono::seconds(120);
constexpr double in_position = 2e-6;  // m

struct Settings {
  double low = 0, high = 0, max_speed = 0, acceleration = 0;  // m, m/s, m/s2
};

class LineStage final : public DriverBase {
 public:
  LineStage(const Settings& settings, DriverHost& driver_host)
      : DriverBase(driver_host),
        settings_(settings),
        poll_(driver_host.loop(), [this] { ask(), poll_.start(poll_period); }),
        limit_(driver_host.loop(), [this] { fail_motion("motion timed out"); }),
        silence_(driver_host.loop(), [this] {
          raise({.code = Errc::timeout, .what = "stage silent", .hint = "Check power and cable"});
        }) {}

  Status open() override {
    if (Status taken = attach(); !taken) return taken;
    silence_.expect_within(reply_limit);
    return put("*IDN?\n");
  }
  Status arm() override {
    if (Status allowed = require(DriverState::open, "arm"); !allowed) return allowed;
    put("EN 1\nABORT\n");  // ends a motion that an earlier host started
    put("ACC ", settings_.acceleration * 1e3);
    return ask();
  }
  Result<std::uint32_t> command(const Command& command) override {
    if (Status allowed = require(DriverState::armed, "command"); !allowed)
      return pass(std::move(allowed.error()));
    return std::visit([this](const auto& c) { return run(c); }, command);
  }
  void stop() override { end_motion(), put("ABORT\n"); }
  void close() override { make_safe(), detach(), enter(LifecycleEvent::close); }

 private:
  void make_safe() noexcept override {
    end_motion(), silence_.stop();
    constexpr std::string_view abort = "ABORT\n";
    if (attached() && state() != DriverState::closed)
      send_last({reinterpret_cast<const std::uint8_t*>(abort.data()), abort.size()});
  }

  Result<std::uint32_t> run(const HomeCommand&) {
    begin(std::nullopt, home_limit);
    put("HOME\n"), ask();
    return last_id_;
  }
  Result<std::uint32_t> run(const MoveCommand& move) {
    if (Status allowed = check(move.target, move.speed); !allowed) return pass(allowed.error());
    const double way = std::abs(move.target - position_);
    begin(move.target,
          from_seconds(5 + 2 * (way / move.speed + move.speed / settings_.acceleration)));
    go(move.target, move.speed);
    return last_id_;
  }
  // A velocity command is a bounded move, so that the stage stops by itself if the host dies.
  Result<std::uint32_t> run(const ServoCommand& servo) {
    end_motion();
    if (servo.velocity == 0) return put("STOP\n"), 0;
    const double target = std::clamp(position_ + servo.velocity * to_seconds(servo.horizon),
                                     settings_.low, settings_.high);
    if (Status allowed = check(target, std::abs(servo.velocity)); !allowed)
      return pass(allowed.error());
    return go(target, std::abs(servo.velocity)), 0;
  }
  Result<std::uint32_t> run(const PollCommand&) { return ask(), 0; }
  Result<std::uint32_t> run(const BiasCommand&) {
    return fail({.code = Errc::unsupported, .what = "bias not supported by a stage"});
  }

  Status check(double target, double speed) const {
    if (!homed_)
      return fail(
          {.code = Errc::wrong_state, .what = "stage not homed", .hint = "Home the stage first"});
    if (target >= settings_.low && target <= settings_.high && speed > 0 &&
        speed <= settings_.max_speed)
      return {};
    return fail(
        {.code = Errc::range,
         .what = "target or speed outside the limits",
         .expected = std::to_string(settings_.low * 1e3) + " to " +
                     std::to_string(settings_.high * 1e3) + " mm, at most " +
                     std::to_string(settings_.max_speed * 1e3) + " mm/s",
         .got = std::to_string(target * 1e3) + " mm, " + std::to_string(speed * 1e3) + " mm/s"});
  }
  void begin(std::optional<double> target, Duration limit) {
    ++last_id_, target_ = target, under_way_ = true;
    begun_at_ask_ = asked_;
    limit_.start(limit), poll_.start(poll_period);
  }
  void end_motion() { under_way_ = false, limit_.cancel(), poll_.cancel(); }
  void go(double target, double speed) {
    put("VEL ", speed * 1e3), put("MOV ", target * 1e3), ask();
  }

  void received(ByteView bytes, TimePoint arrival) override {
    for (const std::uint8_t byte : bytes) {
      if (!attached()) return;
      if (byte != '\n' && line_.size() < 200) line_ += static_cast<char>(byte);
      if (byte == '\n') on_line(std::exchange(line_, {}), arrival);
    }
  }
  void on_line(const std::string& line, TimePoint arrival) {
    if (!line.starts_with("STAT ")) return greet(line);
    std::array<double, 5> fields{};  // mm, moving, homed, limit, error
    const char* at = line.data() + 4;
    for (double& field : fields) {
      const auto read =
          std::from_chars(at + (*at == ' ' ? 1 : 0), line.data() + line.size(), field);
      if (read.ec != std::errc{}) return host().log(LogLevel::warning, "invalid line: " + line);
      at = read.ptr;
    }
    if (state() == DriverState::closed) return;  // reply to an earlier host
    ++answered_;
    asked_ == answered_ ? silence_.stop() : silence_.expect_within(reply_limit);
    if (fields[4] != 0)
      return raise({.code = Errc::device, .what = "error reported by the stage", .got = line});
    position_ = fields[0] * 1e-3, homed_ = fields[2] != 0;
    const bool moving = fields[1] != 0;
    if (under_way_ && !moving && answered_ > begun_at_ask_) arrived();
    if (!attached()) return;
    if (state() == DriverState::open) enter(LifecycleEvent::armed);
    host().publish({arrival, sequence_++, 0,
                    StageSample{position_, moving, homed_, fields[3] != 0, confirmed_id_}});
  }
  // Called at rest, by a reply to a request that was sent after the start of the motion.
  void arrived() {
    if (target_ ? std::abs(position_ - *target_) > in_position : !homed_)
      return fail_motion("stage stopped before its target");
    confirmed_id_ = last_id_, end_motion();
  }
  void fail_motion(const char* what) {
    raise({.code = Errc::device_motion,
           .what = what,
           .got = std::to_string(position_ * 1e3) + " mm"});
  }
  void greet(const std::string& line) {
    if (state() != DriverState::closed || std::count(line.begin(), line.end(), ',') != 3) return;
    silence_.stop();
    host().identified({{{"identity", line}}, {{"mm_per_m", 1e3}}});
    enter(LifecycleEvent::opened);
  }

  Status ask() {
    ++asked_;
    silence_.expect_reply_within(reply_limit);
    return put("STAT?\n");
  }
  Status put(std::string_view text) {
    if (send({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()})) return {};
    return fail({.code = Errc::io, .what = "command not sent: the link did not accept it"});
  }
  Status put(const char* verb, double value) {
    std::array<char, 64> text{};
    const int size = std::snprintf(text.data(), text.size(), "%s%.6f\n", verb, value);
    return put(std::string_view(text.data(), static_cast<std::size_t>(size)));
  }

  Settings settings_;
  std::string line_;
  double position_ = 0;
  bool homed_ = false, under_way_ = false;
  std::optional<double> target_;  ///< position [m]; none while homing
  std::uint32_t last_id_ = 0, confirmed_id_ = 0, sequence_ = 0;
  std::uint64_t asked_ = 0, answered_ = 0, begun_at_ask_ = 0;
  Timer poll_, limit_;
  Watchdog silence_;
};

// Weft passes the limit of the rig file under the name "acceleration_mm_s2".
constexpr const char* schema = R"({"type": "object", "additionalProperties": false, "properties": {
  "travel_mm": {"type": "array"}, "max_speed_mm_s": {"type": "number"},
  "acceleration_mm_s2": {"type": "number"}}})";

Result<std::unique_ptr<Driver>> create(std::string_view json, DriverHost& host) {
  ConfigReader config(json);
  const auto travel = config.numbers("travel_mm", {0, 100}, {-1000, 1000});
  const double speed = config.number("max_speed_mm_s", 20, {0.001, 1000});
  const double acceleration = config.number("acceleration_mm_s2", 20, {0.1, 10000});
  if (Status ok = config.finish(); !ok) return pass(ok.error());
  const Settings settings{travel[0] * 1e-3, travel[1] * 1e-3, speed * 1e-3, acceleration * 1e-3};
  return std::make_unique<LineStage>(settings, host);
}
}  // namespace

extern const DriverEntry line_stage;
constinit const DriverEntry line_stage{"line_stage", "Linear stage with a text protocol", schema,
                                       create};
WEFT_EXPORT_DRIVER(line_stage);
