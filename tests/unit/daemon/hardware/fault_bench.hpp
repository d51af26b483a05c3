#pragma once
// One driver with one emulated device in virtual time, working during fault injection.

#include <memory>
#include <string>
#include <vector>

#include "daemon/base/loop/timed_loop.hpp"
#include "daemon/hardware/link/memory_link.hpp"
#include "drivers/api/driver.hpp"
#include "sim/rig/rig.hpp"

namespace weft::testing {

/// Copy of a sample's values: taxel samples are views.
struct Seen {
  TimePoint at;
  std::uint32_t sequence = 0;
  std::uint32_t lost = 0;
  bool valid = true;     ///< for vibration: nothing clipped
  std::size_t kind = 0;  ///< index of the alternative of Sample::value
  double value =
      0;  ///< position [mm or degrees], Fz [N], or the mean of a block [counts, m/s2, Pa]
};

class FaultBench final : public DriverHost {
 public:
  /// `device`: lts, lts_encoder, prm, ft, ft_page, digital, digital_mean (ten records a
  /// sample), taxels, cpm, vibro or
  /// vibro_udp.
  explicit FaultBench(const std::string& device);
  ~FaultBench() override;

  /// Opens, arms and, for a stage, homes. False if a fault came first.
  bool ready();
  /// Lets the device work: a stage moves back and forth and is polled as in a scan cycle.
  void work(double seconds);
  void inject(const std::string& fault, const std::string& more = "");
  [[nodiscard]] double now_s() const { return to_seconds(loop_.now()); }
  /// Waits without a command. The stages' own motion is finite.
  void let_go(double seconds) { loop_.run_to(loop_.now() + from_seconds(seconds)); }
  [[nodiscard]] bool at_rest() const {
    const TimePoint now = loop_.now();
    return rig_->stage_positions(now) == rig_->stage_positions(now + from_seconds(0.01));
  }
  Driver& driver() { return *driver_; }
  [[nodiscard]] bool is_stage() const { return stage_; }
  /// Bound of the values of valid samples: the stage's travel here, the force sensor's rating, or
  /// the range of counts.
  [[nodiscard]] double largest_believable() const {
    return stage_ ? 15 : name_ == "ft" ? 120 : 1e5;
  }

  Loop& loop() override { return loop_; }
  Link& link() override { return *host_end_; }
  Link* http() override { return page_end_.get(); }
  void publish(const Sample& sample) override;
  void identified(const DeviceIdentity& identity) override { identities.push_back(identity); }
  void state_changed(DriverState) override {}
  void fault(const Error& error) override;
  void log(LogLevel, std::string_view text) override {
    logs.emplace_back(text);
    log_times_s.push_back(now_s());
  }

  std::vector<Seen> samples;
  std::vector<Error> faults;
  std::vector<double> fault_times_s;
  std::vector<DeviceIdentity> identities;
  std::vector<std::string> logs;
  std::vector<double> log_times_s;
  std::uint32_t moves_done = 0;

 private:
  bool until(const std::function<bool()>& done, double limit_s);
  void next_move();
  void cycle();

  daemon::VirtualLoop loop_;
  std::unique_ptr<sim::Rig> rig_;
  std::unique_ptr<daemon::MemoryLink> host_end_, device_end_, page_end_, far_page_end_;
  std::string name_;
  bool stage_ = false;
  double unit_ = 1;  ///< SI value of a mm or a degree
  StageSample last_stage_;
  std::uint32_t move_ = 0;
  bool forth_ = true;
  std::unique_ptr<Driver> driver_;
};

}  // namespace weft::testing
