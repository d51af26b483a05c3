#pragma once
// An ATI Net F/T box: RDT requests in, records out, one datagram a call (reference protocols.md
// B.1, B.2).

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "protocols/rdt/page.hpp"
#include "protocols/rdt/rdt.hpp"
#include "protocols/rdt/tcp_command.hpp"
#include "sim/devices/bench_world.hpp"
#include "sim/devices/force_emulator.hpp"
#include "sim/devices/ft_sensor.hpp"
#include "sim/devices/tool_transform.hpp"

namespace weft::sim {

struct RdtEmulatorParams {
  double rate_hz = 100;                   ///< RDT output rate of the box, 1 to 7000
  std::size_t records_per_datagram = 10;  ///< in buffered mode, 1 to 40
  double threshold_n = 0;                 ///< |Fz| above it latches the monitor condition; 0: off
  std::string calibration_serial = "FT00000";
  std::string torque_unit = "N-m";  ///< as the page spells it: "N-m" or "Nm", by firmware
  FtSensorParams sensor;
};

class RdtEmulator final : public ForceEmulator {
 public:
  /// `world` outlives the emulator.
  RdtEmulator(const RdtEmulatorParams& params, BenchWorld& world, std::uint64_t seed);

  void receive(ByteView datagram, TimePoint now, ByteSink& out) override;
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;
  void wake(TimePoint now, ByteSink& out) override;

  /// Its settings and present reading, as its HTTP port tells them.
  [[nodiscard]] protocols::rdt::SettingsPage settings(TimePoint now);
  [[nodiscard]] protocols::rdt::CalibrationPage calibration(TimePoint now) const;
  /// What the command port tells and takes. Bias and latch are carried out first [E].
  protocols::rdt::FtReply read_ft(const protocols::rdt::ReadFt& read, TimePoint now);
  [[nodiscard]] protocols::rdt::CalibrationReply calibration_reply(TimePoint now) const;
  /// Errors: unsupported, for a unit that the box does not have.
  Status set_transform(const protocols::rdt::WriteTransform& write);
  /// Of the conditions that a READFT enables. Errors: range, for an axis, an index or a comparison
  /// that there is not.
  Status set_condition(const protocols::rdt::WriteCondition& write);
  /// Of the next stream; 1 to 7000. The box sends every n-th of its 7000 conversions a second: it
  /// takes the next rate upwards that it has [M].
  void set_rate_hz(double rate_hz);
  /// Of buffered streams; 1 to 40.
  void set_records_per_datagram(std::size_t count) { params_.records_per_datagram = count; }
  /// The low-pass filter's number, 0 to 12, which the page shows; readings are not filtered [E].
  void set_user_filter(unsigned number) { user_filter_ = number; }
  /// A box whose stream is switched off hears no start request.
  void enable_rdt(bool on) { rdt_enabled_ = on; }
  void clear_bias() { sensor_.clear_bias(); }

  /// Datagrams that were no request, or a request that a Net F/T does not serve.
  [[nodiscard]] std::uint64_t ignored() const { return ignored_; }

 private:
  void start(const protocols::rdt::Request& request, TimePoint now);
  void stop(ByteSink& out);
  [[nodiscard]] TimePoint sample_time(std::uint64_t sample) const;
  void sample(TimePoint at, ByteSink& out);
  protocols::rdt::Record record_at(TimePoint at);
  void suffer_reading(FtReading& reading, TimePoint at);
  [[nodiscard]] bool condition_met(const std::array<std::int32_t, 6>& counts) const;
  [[nodiscard]] std::array<std::int32_t, 6> transformed(
      const std::array<std::int32_t, 6>& counts) const;
  void suffer_sequence(TimePoint at);
  [[nodiscard]] bool withheld(TimePoint at) const;
  void flush(ByteSink& out);

  RdtEmulatorParams params_;
  BenchWorld* world_;
  FtSensor sensor_;
  ToolTransform transform_;
  std::array<std::optional<protocols::rdt::WriteCondition>, 32> conditions_{};
  std::uint16_t conditions_enabled_ = 0;  ///< a bit for each of the first sixteen
  bool rdt_enabled_ = true;
  unsigned user_filter_ = 0;
  bool streaming_ = false;
  double stream_rate_hz_ = 0;  ///< of the present stream
  bool buffered_ = false;
  std::uint32_t wanted_ = 0;  ///< 0: until stopped
  std::uint64_t taken_ = 0;   ///< samples since the start request
  std::uint32_t sent_ = 0;    ///< the number of the last record
  bool latched_ = false;      ///< the monitor condition
  TimePoint started_{};
  Bytes buffer_;
  std::uint64_t ignored_ = 0;

  // What faults have done.
  std::optional<TimePoint> jumped_, latched_by_;  ///< onset of the fault that was carried out
};

}  // namespace weft::sim
