#pragma once
// An ATI Net F/T box: RDT requests in, records out, one datagram a call (reference protocols.md
// B.1, B.2).

#include <cstdint>

#include "protocols/rdt/rdt.hpp"
#include "sim/devices/bench_world.hpp"
#include "sim/devices/emulator.hpp"
#include "sim/devices/ft_sensor.hpp"

namespace weft::sim {

struct RdtEmulatorParams {
  double rate_hz = 100;                   ///< RDT output rate of the box, 1 to 7000
  std::size_t records_per_datagram = 10;  ///< in buffered mode, 1 to 40
  FtSensorParams sensor;
};

class RdtEmulator final : public Emulator {
 public:
  /// `world` outlives the emulator.
  RdtEmulator(const RdtEmulatorParams& params, BenchWorld& world, std::uint64_t seed);

  void receive(ByteView datagram, TimePoint now, ByteSink& out) override;
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;
  void wake(TimePoint now, ByteSink& out) override;

  /// Datagrams that were no request, or a request that a Net F/T does not serve.
  [[nodiscard]] std::uint64_t ignored() const { return ignored_; }

 private:
  void start(const protocols::rdt::Request& request, TimePoint now);
  void stop(ByteSink& out);
  [[nodiscard]] TimePoint sample_time(std::uint64_t sample) const;
  void sample(TimePoint at, ByteSink& out);
  void flush(ByteSink& out);

  RdtEmulatorParams params_;
  BenchWorld* world_;
  FtSensor sensor_;
  bool streaming_ = false;
  bool buffered_ = false;
  std::uint32_t wanted_ = 0;  ///< 0: until stopped
  std::uint64_t sent_ = 0;    ///< records since the start request
  TimePoint started_{};
  Bytes buffer_;
  std::uint64_t ignored_ = 0;
};

}  // namespace weft::sim
