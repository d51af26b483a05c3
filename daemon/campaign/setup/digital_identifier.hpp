#pragma once
// Reads the identity and the rate of an ATI Digital F/T sensor without changing a setting.

#include <functional>

#include "drivers/ati_digital/exchange.hpp"
#include "protocols/ati_digital/stream.hpp"

namespace weft::daemon {

struct DigitalSensor {
  std::string calibration_serial, part_number;  ///< of calibration 1
  double records_per_s = 0;                     ///< of its stream
};

/// Ends a stream that a host left on and reads the sensor's calibration. Then starts a stream for a
/// moment and ends it. Thread-bound to the loop, which outlives it.
class DigitalIdentifier {
 public:
  using Done = std::function<void(const Result<DigitalSensor>&)>;
  /// Records are counted for this time.
  static constexpr Duration count_time = std::chrono::milliseconds(600);

  DigitalIdentifier(Loop& loop, drivers::Exchange::Send send, Done done);

  /// `done` is called once. Errors: timeout (no such sensor), device_refused.
  void start();
  void received(ByteView bytes);

 private:
  void request_piece();
  void on_registers(std::span<const std::uint16_t> piece);
  void start_stream();
  void on_stream(ByteView bytes);
  void on_counted();

  Loop* loop_;
  Done done_;
  drivers::Exchange exchange_;
  std::vector<std::uint16_t> registers_;
  DigitalSensor sensor_;
  protocols::ati_digital::StreamSplitter stream_;
  bool streaming_ = false;
  std::size_t records_ = 0;
  TimePoint first_{}, last_{};
  Timer counting_;
};

}  // namespace weft::daemon
