#pragma once
// The devices of one rig behind the roles that a campaign needs: five stages, a wrench, taxels; and
// vibrations, where it has them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/hardware/rig/device.hpp"
#include "daemon/hardware/rig/joined_taxels.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "drivers/api/sample.hpp"
#include "recipes/control/guard_watch.hpp"
#include "recipes/control/guards.hpp"
#include "recipes/control/taxel_touch.hpp"

namespace weft::daemon {

/// Sum of the readings of a force/torque sensor that came between two scan cycles: a sensor is
/// often faster than the cycle, and noise falls with the root of what is averaged. Each cycle
/// begins anew, so that nothing bad outlives it.
struct WrenchTotal {
  std::uint64_t readings = 0;
  std::array<double, 3> force_n{};    ///< [N], as in WrenchSample
  std::array<double, 3> torque_nm{};  ///< [N m]

  void add(const WrenchSample& reading) { add({1, reading.force_n, reading.torque_nm}); }
  void add(const WrenchTotal& more) {
    readings += more.readings;
    for (std::size_t i = 0; i < 3; ++i) {
      force_n[i] += more.force_n[i];
      torque_nm[i] += more.torque_nm[i];
    }
  }
  /// Not a number where there are no readings.
  [[nodiscard]] WrenchSample mean() const {
    WrenchSample mean;
    const auto n = static_cast<double>(readings);
    for (std::size_t i = 0; i < 3; ++i) {
      mean.force_n[i] = force_n[i] / n;
      mean.torque_nm[i] = torque_nm[i] / n;
    }
    return mean;
  }
};

using StageAxis = recipes::Axis;
/// Whether bringing a bench up homes its stages.
enum class Homing : std::uint8_t { all, none };
using LinkFactory = std::function<Result<std::unique_ptr<Link>>(const DeviceEntry&)>;

/// What the bench said last. SI; joints as recipes::Joints counts them.
struct Snapshot {
  std::array<StageSample, recipes::axis_count> stage{};
  std::array<std::optional<TimePoint>, recipes::axis_count> stage_at{};
  /// Axes without a stage: homed and at rest, and never read.
  std::array<bool, recipes::axis_count> fixed{};
  WrenchSample wrench;
  std::optional<TimePoint> wrench_at;
  WrenchTotal wrench_recent;                  ///< readings since Bench::begin_recent()
  std::vector<recipes::TaxelReading> taxels;  ///< of each array, as the rig file lists them
  [[nodiscard]] recipes::Joints joints() const;
};

/// Owns the devices; keeps the newest readings. Thread-bound to its loop.
class Bench {
 public:
  using SensorSink = std::function<void(const Device&, const Sample&)>;

  /// Makes every device of the rig file; `pages` opens the HTTP ports of those that have one.
  /// Errors carry the device's name.
  static Result<std::unique_ptr<Bench>> create(const RigFile& rig, Loop& loop,
                                               const LinkFactory& links,
                                               const LinkFactory& pages = {});
  ~Bench();

  /// Opens and arms every device, then homes the stages, z first (up, away from the cloth); with
  /// Homing::none nothing moves. `done` is called once, with the first fault or the device that did
  /// not get ready in time.
  void bring_up(std::function<void(Status)> done, Homing homing = Homing::all);
  [[nodiscard]] const Snapshot& snapshot() const { return snapshot_; }
  /// The readings so far have been looked at: another cycle begins.
  void begin_recent() { snapshot_.wrench_recent = {}; }
  /// What the sensor reads at its zero; taken off every sample from now on, recorded ones included.
  void set_zero(const WrenchSample& zero) { zero_ = zero; }
  /// The first fault of any device, or of what the host itself needs.
  [[nodiscard]] const Error* fault() const;
  /// A fault that no device has: the run ends by it as by a device's. The first one counts.
  void report_fault(Error error) {
    if (!host_fault_) host_fault_ = std::move(error);
  }
  [[nodiscard]] bool has_stage(StageAxis axis) const {
    return stages_[recipes::index(axis)] != nullptr;
  }
  /// has_stage() must be true.
  Device& stage(StageAxis axis) { return *stages_[recipes::index(axis)]; }
  [[nodiscard]] bool has_wrench() const { return wrench_ != nullptr; }
  /// has_wrench() must be true.
  Device& wrench() { return *wrench_; }
  /// Of a rig without a force sensor; otherwise it sees no frame.
  recipes::TaxelTouch& touch() { return touch_; }
  [[nodiscard]] const recipes::TaxelTouch& touch() const { return touch_; }
  [[nodiscard]] const std::vector<std::unique_ptr<Device>>& devices() const { return devices_; }
  /// Sees every sample of wrench, taxels and vibrations after the snapshot was updated; those of
  /// several tactile arrays joined, as the first one's.
  void on_sensor_sample(SensorSink sink) { sensor_sink_ = std::move(sink); }
  /// Hears every line of every driver's log.
  void on_log(const Device::LogSink& sink);

 private:
  explicit Bench(Loop& loop) : loop_(&loop) {}
  void connect(Device& device);
  void hold(const FixedAxes& fixed);
  void on_wrench(Sample sample);
  void on_taxels(Device& device, std::size_t array, const Sample& sample);
  void await(std::function<bool()> ready, Duration limit, std::string what,
             std::function<void()> then);
  void poll();
  void home(std::size_t position);
  void read_all();
  void finish(Status outcome);

  Loop* loop_;
  std::vector<std::unique_ptr<Device>> devices_;
  std::array<Device*, recipes::axis_count> stages_{};
  Device* wrench_ = nullptr;
  JoinedTaxels taxels_;
  Snapshot snapshot_;
  std::optional<Error> host_fault_;
  recipes::TaxelTouch touch_;
  WrenchSample zero_;  ///< forces and torques at rest
  SensorSink sensor_sink_;

  // bringing up: what is awaited, until when, and what follows
  std::function<bool()> ready_;
  std::function<void()> then_;
  std::string awaited_;
  TimePoint deadline_;
  TimerId poll_timer_ = 0;
  std::function<void(Status)> done_;
};

}  // namespace weft::daemon
