#pragma once
// The HTTP port of a Net F/T box: its settings and calibration pages. Source:
// docs/reference/device-facts.md, Net F/T pages.

#include <functional>
#include <string>

#include "sim/devices/emulator.hpp"
#include "sim/devices/rdt_emulator.hpp"

namespace weft::sim {

/// One connection: READFT, READCALINFO, WRITETRANSFORM and WRITECONDITION (WRITETHRESHOLD in newer
/// manuals). Other commands are not answered.
class NetftCommandEmulator final : public ClientEmulator {
 public:
  /// `box` is asked at each request; nullptr: the box is off, and nothing is answered.
  explicit NetftCommandEmulator(std::function<RdtEmulator*()> box) : box_(std::move(box)) {}

  void receive(ByteView bytes, TimePoint now, ByteSink& out) override;

 private:
  void answer(ByteView request, TimePoint now, ByteSink& out);

  std::function<RdtEmulator*()> box_;
  Bytes waiting_;
};

/// One connection, one answer; in memory, where there are no connections, what comes after an
/// answer is of the next. Pages: /netftapi2.xml (with "index=n", of that configuration),
/// /netftcalapi.xml; those of NetftSettings, which send on to a page for people;
/// /rundata.cgi?cmd=bias, also setuserbias and clearuserbias; / (a word of welcome).
class NetftPageEmulator final : public ClientEmulator {
 public:
  /// `box` is asked at each request; nullptr: the box is off.
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
