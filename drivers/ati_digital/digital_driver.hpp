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
  int calibration = 1;  ///< 1 to 16, number of a stored calibration
  /// Fz of the sample = sign_z * Fz of the device. +1 if pushing the plate down is positive.
  double sign_z = 1;
  double rate_hz = 100;       ///< samples per second
  std::uint32_t average = 1;  ///< number of records averaged to one sample
  Duration reply_timeout{};   ///< per try of a request
  Duration stale_after{};
  Duration stuck_after{};          ///< zero: never
  std::string calibration_serial;  ///< empty: any
};

/// JSON Schema of the configuration.
extern const char digital_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<DigitalSettings> read_digital_settings(std::string_view config_json);

/// Driver for an ATI Digital F/T sensor; see README.md.
extern const DriverEntry ati_digital_entry;

/// Bit of WrenchSample::status outside the sensor's status word: a record of the stream reported
/// that the word is not 0. The other bits were read when the sensor was opened: the word cannot be
/// read while the sensor streams.
inline constexpr std::uint32_t stream_status_error = 1U << 31;

/// Mean of a few records of the stream: sums them until a sample is complete.
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
  /// Starts the next sample. Returns the number of samples that the lost records would have made;
  /// the remainder is added to the next sample.
  std::uint32_t begin_next(std::uint32_t records_per_sample) {
    const std::uint32_t samples = lost_ / records_per_sample;
    const std::uint32_t left = lost_ % records_per_sample;
    *this = {};
    lost_ = left;
    return samples;
  }

 private:
  /// End of the converter's range: the true value may be anywhere beyond.
  static constexpr std::int16_t rail = 32767;
  std::array<std::int64_t, protocols::ati_digital::gauges> sums_{};
  std::uint32_t count_ = 0;
  std::uint32_t lost_ = 0;
  bool saturated_ = false;
  bool status_error_ = false;
};

/// Reads the calibration, activates it and publishes the stream as WrenchSamples in SI. Does not
/// allocate while streaming.
class DigitalDriver final : public DriverBase {
 public:
  DigitalDriver(const DigitalSettings& settings, DriverHost& driver_host);

  /// Becomes open once the calibration has been read, activated and read back.
  Status open() noexcept override;
  /// Becomes armed with the first record of the stream.
  Status arm() noexcept override;
  /// BiasCommand only. The driver keeps the bias; the sensor has none. Errors: wrong_state,
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

  // While opening.
  std::vector<std::uint16_t> registers_;  ///< registers of the calibration read until now
  std::vector<Request> setup_;            ///< requests to send, in reverse order
  protocols::ati_digital::Calibration calibration_;
  std::uint16_t status_word_ = 0;
  bool unlocked_ = false;

  // While streaming.
  protocols::ati_digital::GaugeMatrix matrix_;
  protocols::ati_digital::StreamSplitter stream_;
  WrenchMean mean_;
  WrenchWatch watch_;
  std::array<double, 6> bias_{};  ///< N, N m
  std::array<double, 6> last_{};  ///< N, N m, before bias
  std::uint32_t sequence_ = 0;
  bool overrange_ = false;  ///< logged once per episode
  bool errors_ = false;     ///< logged once per episode
  std::uint64_t damage_reported_ = 0;
  TimePoint damage_reported_at_{};
  TimePoint arrival_{};  ///< arrival of the bytes being decoded
};

}  // namespace weft::drivers
