#pragma once
// The devices of one rig by the roles that a campaign needs: five stages, a wrench, taxels, and
// optional vibrations.

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

/// Sum of the readings of a force/torque sensor between two scan cycles. A sensor is often faster
/// than the cycle, and noise falls with the root of the number of averaged readings. Each cycle
/// starts anew, so that no bad reading outlives it.
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
  /// Not a number without readings.
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
/// Whether bring_up() homes the stages.
enum class Homing : std::uint8_t { all, none };
using LinkFactory = std::function<Result<std::unique_ptr<Link>>(const DeviceEntry&)>;

/// Newest readings of the bench. SI; joints as in recipes::Joints.
struct Snapshot {
  std::array<StageSample, recipes::axis_count> stage{};
  std::array<std::optional<TimePoint>, recipes::axis_count> stage_at{};
  /// Axes without a stage: homed and at rest, and never read.
  std::array<bool, recipes::axis_count> fixed{};
  WrenchSample wrench;
  std::optional<TimePoint> wrench_at;
  WrenchTotal wrench_recent;                  ///< readings since Bench::begin_recent()
  std::vector<recipes::TaxelReading> taxels;  ///< of each array, in the order of the rig file
  [[nodiscard]] recipes::Joints joints() const;
};

/// Owns the devices; stores the newest readings. Thread-bound to its loop.
class Bench {
 public:
  using SensorSink = std::function<void(const Device&, const Sample&)>;

  /// Makes every device of the rig file; `pages` opens the HTTP ports of those that have one.
  /// Errors have the device's name.
  static Result<std::unique_ptr<Bench>> create(const RigFile& rig, Loop& loop,
                                               const LinkFactory& links,
                                               const LinkFactory& pages = {});
  ~Bench();

  /// Opens and arms every device, then homes the stages, z first (up, away from the fabric). With
  /// Homing::none nothing moves. Calls `done` once, with the first fault or with the device that
  /// was not ready in time.
  void bring_up(std::function<void(Status)> done, Homing homing = Homing::all);
  [[nodiscard]] const Snapshot& snapshot() const { return snapshot_; }
  /// The readings so far are processed: starts the sums of the next cycle.
  void begin_recent() { snapshot_.wrench_recent = {}; }
  /// Reading of the unloaded sensor; subtracted from every sample from now on, recorded ones
  /// included.
  void set_zero(const WrenchSample& zero) { zero_ = zero; }
  /// The first fault of any device, or of the host itself.
  [[nodiscard]] const Error* fault() const;
  /// Reports a fault without a device: it ends the run like a device's. Only the first one counts.
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
  /// For a rig without a force sensor; otherwise it receives no frame.
  recipes::TaxelTouch& touch() { return touch_; }
  [[nodiscard]] const recipes::TaxelTouch& touch() const { return touch_; }
  [[nodiscard]] const std::vector<std::unique_ptr<Device>>& devices() const { return devices_; }
  /// Receives every sample of wrench, taxels and vibrations after the snapshot was updated. Several
  /// tactile arrays arrive joined, as the first one's.
  void on_sensor_sample(SensorSink sink) { sensor_sink_ = std::move(sink); }
  /// Receives every line of every driver's log.
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

  // bring-up: the awaited condition, its deadline, and the next step
  std::function<bool()> ready_;
  std::function<void()> then_;
  std::string awaited_;
  TimePoint deadline_;
  TimerId poll_timer_ = 0;
  std::function<void(Status)> done_;
};

}  // namespace weft::daemon
