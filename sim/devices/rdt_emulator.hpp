#pragma once
// An ATI Net F/T box: receives RDT requests and sends records, one datagram per call; also its
// command port and its web pages. Source: docs/reference/device-facts.md, Net F/T stream, Net F/T
// status word and Net F/T pages.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/rdt/page.hpp"
#include "protocols/rdt/rdt.hpp"
#include "protocols/rdt/tcp_command.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/devices/emulator.hpp"
#include "sim/devices/ft_sensor.hpp"

namespace weft::sim {

/// The new origin is `offset_m` from the sensor's, along the sensor's axes. The frame is then
/// turned about its own x, then its y, then its z axis. This order is from memory.
class ToolTransform {
 public:
  ToolTransform() = default;
  /// Errors: unsupported, for a unit that the box does not have.
  static Result<ToolTransform> create(const protocols::rdt::Configuration& of);

  [[nodiscard]] bool none() const { return *this == ToolTransform{}; }
  [[nodiscard]] Wrench apply(const Wrench& sensed) const;

  bool operator==(const ToolTransform&) const = default;

 private:
  std::array<double, 3> offset_m_{};
  std::array<double, 3> turn_rad_{};
};

/// Conversions per second; a box sends every n-th one.
inline constexpr double conversions_hz = 7000;

/// Settings of the box's web pages. Forms, keys and limits are those of a public client. It has
/// them from the box's manual (9620-05-NET FT-22, 7.1 to 7.4) and has tried them on a box with
/// firmware 2.2.59.
struct NetftSettings {
  double rate_hz = 100;                          ///< of the next stream, 1 to 7000
  std::size_t records_per_datagram = 10;         ///< of buffered streams, 1 to 40
  bool rdt_enabled = true;                       ///< if false, start requests are ignored
  bool ethernet_ip = false, multi_unit = false;  ///< shown only [E]
  unsigned user_filter = 0;  ///< number of the low-pass filter; readings are not filtered [E]
  bool peak_logging = false;
  std::array<std::int32_t, 6> bias_counts{};  ///< for force and torque; a box has its gauges' [E]
  std::array<protocols::rdt::Configuration, protocols::rdt::configurations> configuration;
  unsigned active = 0;  ///< index of the active configuration
  bool thresholds_enabled = false;
  std::array<protocols::rdt::Threshold, protocols::rdt::thresholds> threshold;
};

struct RdtEmulatorParams {
  double rate_hz = 100;                   ///< initial RDT output rate of the box, 1 to 7000
  std::size_t records_per_datagram = 10;  ///< initial number in buffered mode, 1 to 40
  double threshold_n = 0;                 ///< |Fz| above it latches the monitor condition; 0: off
  std::string calibration_serial = "FT00000";
  /// Spelling of the page, by firmware: "Nm" (2.2.59, the pages served here) or "N-m".
  std::string torque_unit = "Nm";
  FtSensorParams sensor;
};

class RdtEmulator final : public ForceEmulator {
 public:
  /// `bench_plant` must outlive the emulator.
  RdtEmulator(const RdtEmulatorParams& params, BenchPlant& bench_plant, std::uint64_t seed);

  void receive(ByteView datagram, TimePoint now, ByteSink& out) override;
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;
  void wake(TimePoint now, ByteSink& out) override;

  /// Settings and present reading, as the HTTP port returns them. `configuration`: another one than
  /// the active one, below rdt::configurations.
  [[nodiscard]] protocols::rdt::SettingsPage page(TimePoint now,
                                                  std::optional<std::size_t> configuration = {});
  [[nodiscard]] protocols::rdt::CalibrationPage calibration(TimePoint now) const;
  /// Reading for the command port. Bias and latch reset are carried out first [E].
  protocols::rdt::FtReply read_ft(const protocols::rdt::ReadFt& read, TimePoint now);
  [[nodiscard]] protocols::rdt::CalibrationReply calibration_reply(TimePoint now) const;
  /// Errors: unsupported, for a unit that the box does not have.
  Status set_transform(const protocols::rdt::WriteTransform& write);
  /// Sets a condition that READFT enables; conditions 16 to 31 have no effect. Errors: range, for
  /// an invalid axis, index or comparison.
  Status set_condition(const protocols::rdt::WriteCondition& write);
  /// Settings of the pages, all within the box's range. A unit with counts beyond the command
  /// port's 32 bits keeps the old one [E].
  [[nodiscard]] NetftSettings settings() const;
  void take(const NetftSettings& settings);
  /// Makes the present load the bias.
  void bias(TimePoint now);

  /// Datagrams that are no request, or a request that a Net F/T does not serve.
  [[nodiscard]] std::uint64_t ignored() const { return ignored_; }

 private:
  void start(const protocols::rdt::Request& request, TimePoint now);
  void stop(ByteSink& out);
  [[nodiscard]] TimePoint sample_time(std::uint64_t sample) const;
  void sample(TimePoint at, ByteSink& out);
  protocols::rdt::Record record_at(TimePoint at);
  void apply_reading_faults(FtReading& reading, TimePoint at);
  [[nodiscard]] std::uint16_t breached_by(const std::array<std::int32_t, 6>& counts) const;
  void update_peaks(const std::array<std::int32_t, 6>& counts);
  void reset_latch();
  [[nodiscard]] bool fits(const protocols::rdt::Configuration& configuration) const;
  [[nodiscard]] double counts_per_force(const protocols::rdt::Configuration& of,
                                        TimePoint now) const;
  [[nodiscard]] double counts_per_torque(const protocols::rdt::Configuration& of,
                                         TimePoint now) const;
  [[nodiscard]] std::string spelled_torque_unit(unsigned code) const;
  [[nodiscard]] std::array<std::int32_t, 6> transformed(
      const std::array<std::int32_t, 6>& counts) const;
  void apply_sequence_faults(TimePoint at);
  [[nodiscard]] bool withheld(TimePoint at) const;
  void flush(ByteSink& out);

  RdtEmulatorParams params_;
  BenchPlant* bench_plant_;
  FtSensor sensor_;
  NetftSettings settings_;
  ToolTransform transform_;               ///< of the active configuration
  std::uint16_t conditions_enabled_ = 0;  ///< one bit per threshold, from the last READFT
  bool streaming_ = false;
  double stream_rate_hz_ = 0;  ///< of the present stream
  bool buffered_ = false;
  std::uint32_t wanted_ = 0;    ///< requested samples; 0: until stopped
  std::uint64_t taken_ = 0;     ///< samples since the start request
  std::uint32_t sent_ = 0;      ///< number of the last record
  bool latched_ = false;        ///< the monitor condition
  std::uint16_t breached_ = 0;  ///< thresholds exceeded since the latch was reset
  std::optional<std::array<std::int32_t, 6>> highest_, lowest_;  ///< since logging began
  TimePoint started_{};
  Bytes buffer_;
  std::uint64_t ignored_ = 0;

  // Effects of faults.
  std::optional<TimePoint> jumped_, latched_by_;  ///< start of the fault that was applied
};

/// The command port, one connection: READFT, READCALINFO, WRITETRANSFORM and WRITECONDITION
/// (WRITETHRESHOLD in newer manuals). Other commands are not answered.
class NetftCommandEmulator final : public ClientEmulator {
 public:
  /// `box` is called at each request; nullptr: the box is off, and there is no answer.
  explicit NetftCommandEmulator(std::function<RdtEmulator*()> box) : box_(std::move(box)) {}

  void receive(ByteView bytes, TimePoint now, ByteSink& out) override;

 private:
  void answer(ByteView request, TimePoint now, ByteSink& out);

  std::function<RdtEmulator*()> box_;
  Bytes waiting_;
};

/// The HTTP port: one connection, one answer. In memory there are no connections: bytes after an
/// answer belong to the next request. Pages: /netftapi2.xml (with "index=n", for that
/// configuration), /netftcalapi.xml; those of NetftSettings, which redirect to a page for people;
/// /rundata.cgi?cmd=bias, also setuserbias and clearuserbias; / (a welcome text).
class NetftPageEmulator final : public ClientEmulator {
 public:
  /// `box` is called at each request; nullptr: the box is off.
  explicit NetftPageEmulator(std::function<RdtEmulator*()> box) : box_(std::move(box)) {}

  void receive(ByteView bytes, TimePoint now, ByteSink& out) override;
  [[nodiscard]] bool finished() const override { return finished_; }

 private:
  [[nodiscard]] std::string answer(const std::string& head, TimePoint now);
  [[nodiscard]] std::string page(const protocols::rdt::HttpRequest& request, TimePoint now);
  static void take(RdtEmulator& box, const protocols::rdt::HttpRequest& request, TimePoint now);

  std::function<RdtEmulator*()> box_;
  std::string waiting_;
  bool finished_ = false;
};

}  // namespace weft::sim
