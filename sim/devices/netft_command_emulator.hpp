#pragma once
// The command port of a Net F/T box, TCP 49151. Source: docs/reference/device-facts.md, Net F/T
// command port.

#include <functional>

#include "sim/devices/client_emulator.hpp"
#include "sim/devices/rdt_emulator.hpp"

namespace weft::sim {

/// One connection: READFT, READCALINFO, WRITETRANSFORM and WRITECONDITION (WRITETHRESHOLD in newer
/// manuals). Other commands are not answered.
class NetftCommandEmulator final : public ClientEmulator {
 public:
  /// `box` is asked at each request; nullptr: the box is off, and nothing is answered.
  explicit NetftCommandEmulator(std::function<RdtEmulator*()> box) : box_(std::move(box)) {}

  void receive(ByteView bytes, TimePoint now, ByteSink& out) override;
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override { return std::nullopt; }
  void wake(TimePoint, ByteSink&) override {}
  [[nodiscard]] bool finished() const override { return false; }

 private:
  void answer(ByteView request, TimePoint now, ByteSink& out);

  std::function<RdtEmulator*()> box_;
  Bytes waiting_;
};

}  // namespace weft::sim
