#include "daemon/campaign/bench_session.hpp"

#include <cmath>
#include <deque>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/loop/real_loop.hpp"
#include "daemon/base/loop/threads.hpp"
#include "daemon/campaign/monitor.hpp"
#include "daemon/hardware/rig/device_lock.hpp"
#include "drivers/api/driver.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

/// Host side of the console of weft-rig. Thread-bound to the link's loop.
class RigConsole {
 public:
  using Answer = std::function<void(Status)>;
  explicit RigConsole(std::unique_ptr<Link> link);

  /// Puts a patch of a fabric on the emulated plate. Errors in `answer`: those of weft-rig; io.
  void mount(const recipes::MountFabric& order, Answer answer);
  /// Injects a fault into a device, or ends faults: `fault_json` as in FaultOrder. Errors as of
  /// mount().
  void inject_fault(std::string_view fault_json, bool ends, Answer answer);

 private:
  void send(const std::string& order, Answer answer);
  void take(ByteView bytes);
  void answer(Status status);

  std::deque<Answer> waiting_;
  std::string line_;
  std::unique_ptr<Link> link_;
};

constexpr std::size_t longest_answer = 65536;

Status read_answer(const std::string& line) {
  const json object = json::parse(line, nullptr, false);
  if (!object.is_object())
    return fail({.code = Errc::parse,
                 .where = "console",
                 .what = "invalid reply of weft-rig",
                 .expected = "an object",
                 .got = line});
  if (object.value("ok", false)) return {};
  return fail({.code = Errc::device_refused,
               .where = "weft-rig",
               .what = object.value("error", "request refused without a reason")});
}

RigConsole::RigConsole(std::unique_ptr<Link> link) : link_(std::move(link)) {
  link_->on_receive([this](ByteView bytes, TimePoint) { take(bytes); });
  link_->on_closed([this](const Error& why) {
    while (!waiting_.empty()) answer(pass(why, "console"));
  });
}

void RigConsole::mount(const recipes::MountFabric& order, Answer done) {
  send(json{{"order", "mount"},
            {"fabric", order.fabric},
            {"piece_seed", order.seeds.piece},
            {"mounting_seed", order.seeds.mounting},
            {"touch_seed", order.seeds.touch},
            {"patch", order.place.patch}}
           .dump(),
       std::move(done));
}

void RigConsole::inject_fault(std::string_view fault_json, bool ends, Answer done) {
  json order = json::parse(fault_json);
  order["order"] = ends ? "clear" : "fault";
  send(order.dump(), std::move(done));
}

void RigConsole::send(const std::string& order, Answer done) {
  waiting_.push_back(std::move(done));
  const std::string line = order + "\n";
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(line.data());
  if (Status sent = link_->write({bytes, line.size()}); !sent) answer(std::move(sent));
}

void RigConsole::take(ByteView bytes) {
  for (const std::uint8_t byte : bytes) {
    if (byte != '\n') {
      if (line_.size() < longest_answer) line_.push_back(static_cast<char>(byte));
      continue;
    }
    answer(read_answer(line_));
    line_.clear();
  }
}

void RigConsole::answer(Status status) {
  if (waiting_.empty()) return;
  const Answer done = std::move(waiting_.front());
  waiting_.pop_front();
  done(std::move(status));
}

Status apply_fault(sim::Rig& rig, const FaultOrder& order, TimePoint now) {
  if (!order.ends) return rig.inject(order.json, now);
  const auto end = nlohmann::json::parse(order.json);
  return rig.clear_faults(end.at("device").get<std::string>(), end.at("fault").get<std::string>());
}

class SimulatedSession final : public BenchSession {
 public:
  SimulatedSession(std::unique_ptr<SimulatedBench> bench, SimulatedPlace* place)
      : simulated_(std::move(bench)), place_(place) {}
  ~SimulatedSession() override {
    if (place_ == nullptr) return;
    place_->is_known = true;
    place_->position = simulated_->rig->stage_positions(simulated_->loop.now());
    for (std::size_t i = 0; i < recipes::axis_count; ++i)
      place_->homed[i] = bench().snapshot().stage[i].homed;
    place_->mounted = mounted_;
  }
  Bench& bench() override { return *simulated_->bench; }
  Loop& loop() override { return simulated_->host_time; }
  void run_until(const std::function<bool()>& done) override { simulated_->loop.run_until(done); }
  void mount(const recipes::MountFabric& order, MountDone done) override {
    mounted_ = order;
    const auto& [piece, mounting, touch] = order.seeds;
    done(simulated_->rig->mount(order.fabric, {piece, mounting, touch}, order.place.patch,
                                simulated_->loop.now()));
  }
  void inject_fault(const FaultOrder& order) override {
    order.callback(apply_fault(*simulated_->rig, order, simulated_->loop.now()));
  }
  sim::Rig* plant() override { return simulated_->rig.get(); }
  [[nodiscard]] SessionLoad load() const override {
    return {simulated_->rig_time.seconds(), simulated_->host_time.seconds(),
            simulated_->loop.events()};
  }

 private:
  std::unique_ptr<SimulatedBench> simulated_;
  SimulatedPlace* place_;
  recipes::MountFabric mounted_;
};

/// The rig file with its emulated stages at `place`.
RigFile rig_at(const RigFile& rig, const SimulatedPlace& place) {
  json root = json::parse(rig.text);
  for (json& device : root.at("devices"))
    for (const StageAxis axis : recipes::all_axes) {
      if (device.value("role", "") != recipes::to_string(axis)) continue;
      const bool linear = recipes::is_linear(axis);
      const double position = place.position[recipes::index(axis)];
      json& emulator = device["emulator"];
      emulator[linear ? "start_mm" : "start_deg"] = position / (linear ? m_per_mm : rad_per_deg);
      emulator["homed"] = place.homed[recipes::index(axis)];
    }
  RigFile there = rig;
  there.text = root.dump();
  return there;
}

/// Devices behind ports, in real time.
class PortSession final : public BenchSession {
 public:
  PortSession(std::unique_ptr<DeviceLocks> locks, std::unique_ptr<Monitor> monitor,
              double clear_z_m)
      : locks_(std::move(locks)), monitor_(std::move(monitor)), clear_z_m_(clear_z_m) {}
  static Result<std::unique_ptr<BenchSession>> open(const SessionRequest& request) {
    auto locks = std::make_unique<DeviceLocks>();
    if (Status locked = locks->acquire(request.rig); !locked) return pass(locked.error());
    auto monitor = Monitor::start({emergency_stops(request.rig, request.limits.max_speed_mps),
                                   locks->descriptors(), request.monitor_log});
    if (!monitor) return pass(monitor.error());
    auto session = std::make_unique<PortSession>(std::move(locks), std::move(*monitor),
                                                 request.limits.clear_z_m());
    if (request.rig.mode == BenchMode::emulated) {
      auto console = open_tcp(session->loop_, request.rig.console);
      if (!console) return pass(Error(console.error()).in("weft-rig"));
      session->console_ = std::make_unique<RigConsole>(std::move(*console));
    }
    auto bench = Bench::create(
        request.rig, session->loop_,
        [&](const DeviceEntry& entry) { return open_link(session->loop_, entry.link); },
        [&](const DeviceEntry& entry) { return open_page(session->loop_, entry); });
    if (!bench) return pass(bench.error());
    session->bench_ = std::move(*bench);
    return std::unique_ptr<BenchSession>(std::move(session));
  }
  Bench& bench() override { return *bench_; }
  Loop& loop() override { return loop_; }
  void run_until(const std::function<bool()>& done) override {
    monitor_->watch(true);
    beat();
    loop_.run_until(done);
    loop_.cancel(heart_);
    monitor_->watch(false);
  }
  [[nodiscard]] bool real_time() const override { return true; }
  void mount(const recipes::MountFabric& order, MountDone done) override {
    if (console_) return console_->mount(order, std::move(done));
    done(
        {});  // by a person, who has confirmed the operator step: check_recipe() requires that step
  }
  void inject_fault(const FaultOrder& order) override {
    if (!console_) return BenchSession::inject_fault(order);
    console_->inject_fault(order.json, order.ends, order.callback);
  }
  void forbid_lift() override {
    lift_forbidden_ = true;
    monitor_->plan_lift(std::nullopt);
  }
  [[nodiscard]] std::string advice() const override { return real_time_.advice(); }

 private:
  static constexpr Duration heart_period = std::chrono::milliseconds(100);
  void beat() {
    monitor_->plan_lift(lift());
    monitor_->beat();
    if (!monitor_->is_alive()) report_lost_monitor();
    heart_ = loop_.after(heart_period, [this] { beat(); });
  }

  /// Lifts to the clear height, never downwards: a probe above it stays there.
  [[nodiscard]] std::optional<Lift> lift() const {
    const StageSample& z = bench_->snapshot().stage[recipes::index(StageAxis::z)];
    if (!z.homed || lift_forbidden_ || z.position <= clear_z_m_) return std::nullopt;
    return Lift{z.position, clear_z_m_};
  }

  /// Without the monitor nothing stops the stages when this process ends, so a fault ends the run.
  void report_lost_monitor() {
    bench_->report_fault({.code = Errc::wrong_state,
                          .where = "monitor",
                          .what = "monitor of this run ended or stopped",
                          .expected = "process " + std::to_string(monitor_->process()),
                          .got = "none",
                          .hint = "Check the system log for the cause, then resume the run"});
  }

  std::unique_ptr<DeviceLocks> locks_;  ///< released last, after the ports are closed
  std::unique_ptr<Monitor> monitor_;    ///< started before the real-time priority and the ports
  double clear_z_m_;
  bool lift_forbidden_ = false;
  RealTimeScope real_time_;
  RealLoop loop_;
  TimerId heart_ = 0;
  std::unique_ptr<RigConsole> console_;
  std::unique_ptr<Bench> bench_;
};

// Drivers and emulators are configured apart: contradictions are refused before the run.
Result<std::unique_ptr<BenchSession>> simulated_session(const SessionRequest& request) {
  const Result<std::string> fabrics = read_fabrics(request.rig, request.rig_path);
  if (!fabrics) return pass(fabrics.error());
  SimulatedPlace place;
  if (request.begins_there && request.place != nullptr) place = *request.place;
  auto bench = SimulatedBench::create(place.is_known ? rig_at(request.rig, place) : request.rig,
                                      *fabrics, request.seed);
  if (!bench) return pass(bench.error());
  if (Status same = same_rates(request.rig, request.limits, *(*bench)->rig); !same)
    return pass(same.error());
  auto session = std::make_unique<SimulatedSession>(std::move(*bench), request.place);
  Status mounted;
  if (!place.mounted.fabric.empty())
    session->mount(place.mounted, [&mounted](Status done) { mounted = std::move(done); });
  if (!mounted) return pass(mounted.error());
  return std::unique_ptr<BenchSession>(std::move(session));
}

}  // namespace

void BenchSession::inject_fault(const FaultOrder& order) {
  order.callback(
      fail({.code = Errc::unsupported,
            .where = "bench",
            .what = "fault injection is available on simulated and emulated benches only"}));
}

Status bring_up(BenchSession& session, const StopRequested& stop_requested, Homing homing) {
  std::optional<Status> up;
  session.bench().bring_up([&up](Status outcome) { up = std::move(outcome); }, homing);
  session.run_until([&] { return up.has_value() || stop_requested(); });
  if (up) return *up;
  if (stop_requested())
    return fail({.code = Errc::wrong_state,
                 .where = "bench",
                 .what = "stopped while the bench was starting"});
  return fail({.code = Errc::timeout, .where = "bench", .what = "bench does not respond"});
}

Result<std::unique_ptr<BenchSession>> open_session(const SessionRequest& request) {
  return request.rig.mode == BenchMode::simulated ? simulated_session(request)
                                                  : PortSession::open(request);
}

namespace {

// One USB or network hop. A real FTDI chip holds small packets up to 16 ms by default; the drivers'
// start-up sets its latency timer to 1 ms.
constexpr Duration link_latency = std::chrono::milliseconds(1);

/// Number of stream records that the driver averages into one sample: `average` of its
/// configuration, or 1.
double records_per_sample(const DeviceEntry& device) {
  const auto config = nlohmann::json::parse(device.config_json, nullptr, false);
  const auto average = nlohmann::json::json_pointer("/average");
  const bool has_average =
      config.is_object() && config.contains(average) && config[average].is_number();
  return has_average ? config[average].get<double>() : 1;
}

}  // namespace

Result<std::unique_ptr<SimulatedBench>> SimulatedBench::create(const RigFile& rig_file,
                                                               std::string_view fabrics_json,
                                                               std::uint64_t seed) {
  auto made = std::make_unique<SimulatedBench>();
  Result<std::unique_ptr<sim::Rig>> rig = sim::Rig::create(rig_file.text, fabrics_json, seed);
  if (!rig) return pass(rig.error());
  made->rig = std::move(*rig);
  const auto attached_by = [&made](auto attach) -> LinkFactory {
    return [&made, attach](const DeviceEntry& entry) -> Result<std::unique_ptr<Link>> {
      auto [host, device] = MemoryLink::make_pair(made->host_time, made->rig_time, link_latency);
      if (Status ok = (made->rig.get()->*attach)(entry.name, *device, made->rig_time); !ok)
        return pass(ok.error());
      made->far_ends.push_back(std::move(device));
      return std::unique_ptr<Link>(std::move(host));
    };
  };
  Result<std::unique_ptr<Bench>> bench =
      Bench::create(rig_file, made->host_time, attached_by(&sim::Rig::attach),
                    attached_by(&sim::Rig::attach_page));
  if (!bench) return pass(bench.error());
  made->bench = std::move(*bench);
  return made;
}

Status same_rates(const RigFile& rig, const recipes::RigLimits& limits, const sim::Rig& emulated) {
  constexpr double tolerance = 1e-3;
  for (std::size_t i = 0; i < rig.devices.size(); ++i) {
    const DeviceEntry& device = rig.devices[i];
    const std::optional<double> sent_hz = emulated.stream_rate_hz(device.name);
    if (!sent_hz) continue;
    const double configured_hz = limits.stream_rate_hz(device.role, device.name);
    if (configured_hz == 0) continue;  // role and samples do not match: found when samples arrive
    const double average_hz = configured_hz * records_per_sample(device);
    if (std::abs(average_hz - *sent_hz) <= tolerance * *sent_hz) continue;
    return fail({.code = Errc::invalid_argument,
                 .where = "/devices/" + std::to_string(i) + "/config/rate_hz",
                 .what = "rate differs between driver and emulator",
                 .expected = std::to_string(*sent_hz) + " Hz, the rate of the emulator",
                 .got = std::to_string(average_hz) + " Hz",
                 .hint = "Change one of the two rates"});
  }
  return {};
}

Result<std::string> read_fabrics(const RigFile& rig_file, const std::filesystem::path& rig_path) {
  const auto root = nlohmann::json::parse(rig_file.text, nullptr, false);
  const auto pointer = nlohmann::json::json_pointer("/simulation/fabrics");
  if (root.is_discarded() || !root.contains(pointer) || !root[pointer].is_string())
    return fail({.code = Errc::invalid_argument,
                 .where = rig_path.string() + ": /simulation/fabrics",
                 .what = "rig file without fabric table",
                 .expected = "a path relative to the rig file"});
  return read_text_file(rig_path.parent_path() / root[pointer].get<std::string>());
}

}  // namespace weft::daemon
