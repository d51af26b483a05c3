#pragma once
// The state machine of one Digital F/T sensor.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/api/driver.hpp"
#include "drivers/api/driver_base.hpp"
#include "drivers/api/wrench_watch.hpp"
#include "drivers/ati_digital/exchange.hpp"
#include "protocols/ati_digital/calibration.hpp"
#include "protocols/ati_digital/stream.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

struct DigitalSettings {
  std::uint8_t slave = 10;
  int calibration = 1;  ///< 1 to 16, of those that the sensor holds
  /// Fz of the sample = sign_z * Fz of the device. +1 where pushing the plate down is positive.
  double sign_z = 1;
  double rate_hz = 100;       ///< samples a second
  std::uint32_t average = 1;  ///< records of the stream whose mean is a sample
  Duration reply_timeout{};   ///< of each of a few tries of a request
  Duration stale_after{};
  Duration stuck_after{};          ///< zero: never
  std::string calibration_serial;  ///< empty: any
};

/// JSON Schema of the configuration.
extern const char digital_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<DigitalSettings> read_digital_settings(std::string_view config_json);

/// Driver for an ATI Digital F/T sensor. One page about it: README.md.
extern const DriverEntry ati_digital_entry;

/// Bit of WrenchSample::status that is not of the sensor's status word: a record of
/// the stream said that the word is not 0. Its other bits are those read when the sensor was
/// opened: the word cannot be read while the sensor streams.
inline constexpr std::uint32_t stream_status_error = 1U << 31;

/// The mean of a few records of the stream: adds them up until there are enough for a sample.
class WrenchMean {
 public:
  void add(const protocols::ati_digital::StreamRecord& record, std::uint32_t lost) {
    for (std::size_t g = 0; g < sums_.size(); ++g) {
      const std::int16_t counts = record.gauge_counts[g];
      sums_[g] += counts;
      saturated_ = saturated_ || counts >= rail || counts <= -rail;
    }
    status_error_ = status_error_ || record.status_error;
    lost_ += lost;
    ++count_;
  }
  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] bool saturated() const { return saturated_; }
  [[nodiscard]] bool status_error() const { return status_error_; }
  [[nodiscard]] std::array<double, protocols::ati_digital::gauges> counts() const {
    std::array<double, protocols::ati_digital::gauges> mean{};
    for (std::size_t g = 0; g < mean.size(); ++g)
      mean[g] = static_cast<double>(sums_[g]) / static_cast<double>(count_);
    return mean;
  }
  /// Samples that the lost records would have made; what is left over counts for the next.
  std::uint32_t begin_next(std::uint32_t records_per_sample) {
    const std::uint32_t samples = lost_ / records_per_sample;
    const std::uint32_t left = lost_ % records_per_sample;
    *this = {};
    lost_ = left;
    return samples;
  }

 private:
  /// The ends of the converter: the gauge may be anywhere beyond.
  static constexpr std::int16_t rail = 32767;
  std::array<std::int64_t, protocols::ati_digital::gauges> sums_{};
  std::uint32_t count_ = 0;
  std::uint32_t lost_ = 0;
  bool saturated_ = false;
  bool status_error_ = false;
};

/// Reads the calibration, makes it the active one and publishes the stream as WrenchSamples in SI.
/// Nothing allocates while streaming.
class DigitalDriver final : public DriverBase {
 public:
  DigitalDriver(const DigitalSettings& settings, DriverHost& driver_host);

  /// Open when the calibration has been read, made active and read back.
  Status open() noexcept override;
  /// Armed when the first record of the stream has come.
  Status arm() noexcept override;
  /// BiasCommand only; this host's own bias, the sensor knows none. Errors: wrong_state,
  /// unsupported.
  Result<std::uint32_t> command(const Command& command) noexcept override;
  /// Ends the stream: armed -> open.
  void stop() noexcept override;
  void close() noexcept override;

 private:
  using Reply = protocols::modbus::Reply;
  using Request = protocols::modbus::Request;
  enum class Phase { idle, opening, starting, streaming };

  void received(ByteView bytes, TimePoint arrival) override;
  void make_safe() noexcept override;

  void send_request(const Request& request, void (DigitalDriver::*then)(const Reply&));
  void on_hushed(const Status& status);
  void on_status(const Reply& reply);
  void request_piece();
  void on_piece(const Reply& reply);
  void on_calibration();
  void request_setup();
  void on_setup(const Reply& reply);
  void on_read_back(const Reply& reply);
  void on_started(const Reply& reply);
  bool accepted(const Reply& reply);

  void on_stream(ByteView bytes, TimePoint arrival);
  void on_record(const protocols::ati_digital::StreamRecord& record, std::uint32_t lost,
                 TimePoint arrival);
  void on_mean(TimePoint arrival);
  Sample to_sample(TimePoint arrival);
  bool within_rating(const std::array<double, 6>& wrench);
  void report_damage(TimePoint arrival);
  void on_stale();
  void end();

  DigitalSettings settings_;
  Phase phase_ = Phase::idle;
  Exchange exchange_;
  Watchdog stale_;

  // opening
  std::vector<std::uint16_t> registers_;  ///< of the calibration, as far as they are read
  std::vector<Request> setup_;            ///< to be sent, last first
  protocols::ati_digital::Calibration calibration_;
  std::uint16_t status_word_ = 0;
  bool unlocked_ = false;

  // streaming
  protocols::ati_digital::GaugeMatrix matrix_;
  protocols::ati_digital::StreamSplitter stream_;
  WrenchMean mean_;
  WrenchWatch watch_;
  std::array<double, 6> bias_{};  ///< N, N m
  std::array<double, 6> last_{};  ///< N, N m, before bias
  std::uint32_t sequence_ = 0;
  bool overrange_ = false;  ///< said once per episode
  bool errors_ = false;     ///< said once per episode
  std::uint64_t damage_reported_ = 0;
  TimePoint damage_reported_at_{};
  TimePoint arrival_{};  ///< of the bytes in hand
};

}  // namespace weft::drivers
