#pragma once
// An ATI Digital F/T sensor: receives Modbus requests, sends answers and a raw stream. Source:
// docs/reference/device-facts.md, ATI Digital F/T.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "protocols/ati_digital/calibration.hpp"
#include "protocols/ati_digital/stream.hpp"
#include "protocols/modbus/modbus.hpp"
#include "protocols/modbus/rtu.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/devices/ft_sensor.hpp"

namespace weft::sim {

// The registers of an emulated ATI Digital F/T sensor. Source: docs/reference/device-facts.md,
// ATI Digital F/T.

/// A calibration of a Mini40 SI-40-2 in the pattern of a real Mini40 (CAL80): gauges 0, 2 and 4
/// carry Fz, Tx and Ty, the others Fx, Fy and Tz. The rated load of one axis is 10000 counts of its
/// strongest gauge. Loads on three axes then stay inside the converter's range [E].
protocols::ati_digital::Calibration mini40_calibration(const std::string& serial,
                                                       double counts_per_n, double counts_per_nm);

/// The registers that hosts read and write. Addresses without a source read as zero.
class DigitalRegisters {
 public:
  using Exceptional = std::optional<protocols::modbus::ExceptionCode>;

  /// All calibrations except `number` (1 to 16) are empty.
  DigitalRegisters(const protocols::ati_digital::Calibration& calibration, int number,
                   std::uint16_t status_word);

  /// Errors: illegal_address beyond the last calibration.
  Exceptional read_holding(std::uint16_t address, std::uint16_t count,
                           protocols::modbus::Registers& out) const;
  /// Writes gains, offsets and the speed's registers while unlocked. Errors, after which nothing is
  /// written: illegal_address, device_failure while locked [E], illegal_value for a speed that does
  /// not exist.
  Exceptional write(std::uint16_t address, std::span<const std::uint16_t> values);
  void lock(bool locked) { locked_ = locked; }

  /// One register of `protocols::ati_digital::holding`.
  [[nodiscard]] std::uint16_t at(std::size_t address) const { return values_[address]; }

  static constexpr std::size_t size = protocols::ati_digital::holding::first_calibration +
                                      std::size_t{protocols::ati_digital::calibrations} *
                                          protocols::ati_digital::calibration_stride;

 private:
  std::array<std::uint16_t, size> values_{};
  bool locked_ = true;
};

struct AtiDigitalParams {
  double rate_hz = 100;  ///< records per second; the real sensor sends about 7000 at 1.25 Mbaud
  std::uint8_t slave = protocols::ati_digital::slave_address;
  int calibration = 1;  ///< number of the calibration that is not empty, 1 to 16
  std::string serial = "FT40001";
  std::uint16_t status_word = 0;  ///< faults that the sensor reports
  /// Behind a Modbus TCP gateway, which passes registers but no stream.
  bool modbus_tcp = false;
  /// Behind a half-duplex adapter, which returns the sent bytes as an echo.
  bool echo = false;
  FtSensorParams sensor;  ///< its quantum and range are those of the gauges here
};

class AtiDigitalEmulator final : public ForceEmulator {
 public:
  /// `bench_plant` must outlive the emulator.
  AtiDigitalEmulator(const AtiDigitalParams& params, BenchPlant& bench_plant, std::uint64_t seed);

  void receive(ByteView bytes, TimePoint now, ByteSink& out) override;
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;
  void wake(TimePoint now, ByteSink& out) override;
  void meet_new_host() override { discard_partial(); }

  [[nodiscard]] bool streaming() const { return streaming_; }

 private:
  using Reply = protocols::modbus::Reply;
  using GaugeCounts = std::array<std::int16_t, protocols::ati_digital::gauges>;

  void discard_partial();
  void serve_rtu(ByteView bytes, TimePoint now, ByteSink& out);
  void serve_tcp(ByteView bytes, TimePoint now, ByteSink& out);
  [[nodiscard]] Reply answer(ByteView pdu, TimePoint now);
  [[nodiscard]] Reply read(const protocols::modbus::Read& read, TimePoint now);
  [[nodiscard]] Reply read_holding(const protocols::modbus::Read& read, TimePoint now) const;
  [[nodiscard]] Reply write(std::uint16_t address, std::span<const std::uint16_t> values,
                            const Reply& done);
  [[nodiscard]] Reply execute_vendor_order(const protocols::modbus::Vendor& order, TimePoint now);
  [[nodiscard]] GaugeCounts convert(TimePoint at);
  void apply_gauge_faults(GaugeCounts& gauges, TimePoint at);
  [[nodiscard]] std::uint16_t status_word(TimePoint at) const;
  void send_record(TimePoint at, ByteSink& out);
  [[nodiscard]] TimePoint record_time(std::uint64_t record) const;

  AtiDigitalParams params_;
  BenchPlant* bench_plant_;
  FtSensor sensor_;
  protocols::ati_digital::Calibration calibration_;
  /// Gauge counts per count of the wrench.
  std::array<std::array<double, 6>, protocols::ati_digital::gauges> gauges_per_count_{};
  DigitalRegisters registers_;
  protocols::modbus::RtuSplitter rtu_;
  protocols::modbus::MbapSplitter tcp_;
  TimePoint received_at_{};  ///< last bytes from the host
  bool streaming_ = false;
  std::size_t jam_bytes_ = 0;  ///< received while streaming
  std::uint64_t sent_ = 0;     ///< records since the stream was started
  TimePoint started_{};
  Bytes buffer_;
};

}  // namespace weft::sim
