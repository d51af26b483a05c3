#pragma once
// A link and a rig for tests: the minimum for the interfaces.

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "drivers/api/driver.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/rig/rig.hpp"
#include "tests/unit/hex.hpp"
#include "tests/unit/plant/support.hpp"
#include "tests/unit/source_text.hpp"
#include "tests/unit/test_loop.hpp"

namespace weft::sim::test {

using testing::hex;
using testing::TestLoop;

/// The device's end of a link; the test is the host.
class TestLink final : public Link {
 public:
  explicit TestLink(TestLoop& loop) : loop_(&loop) {}
  Status write(ByteView bytes) override {
    received.insert(received.end(), bytes.begin(), bytes.end());
    pieces.emplace_back(bytes.begin(), bytes.end());
    return {};
  }
  void on_receive(Receiver receiver) override { receiver_ = std::move(receiver); }
  void on_closed(Closed) override {}
  void send(ByteView bytes) {
    if (receiver_) receiver_(bytes, loop_->now());
  }

  Bytes received;             ///< from the device, as a stream
  std::vector<Bytes> pieces;  ///< the same, write by write

 private:
  TestLoop* loop_;
  Receiver receiver_;
};

/// Stages in the middle of their travel, without quanta or play, over a level plate: for tests of
/// sensors without a rig file.
inline BenchPlantParams still_plant() {
  BenchPlantParams params;
  for (StageParams& stage : params.stages)
    stage = {.low = 0, .high = 0.15, .start = 0.075, .quantum = 0, .backlash = 0};
  for (const std::size_t rotary : {3U, 4U})
    params.stages[rotary] = {.low = -1, .high = 1, .start = 0, .quantum = 0, .backlash = 0};
  params.plant.geometry.plate_z_m = 0.1;
  params.plant.rig_tilt = 0;
  return params;
}

/// Frames of one kind in the device's output, which must have no other bytes.
template <class Splitter, class Frame, class Kind>
std::vector<Frame> frames_of(const TestLink& link, Kind kind) {
  Splitter splitter;
  std::vector<Frame> out;
  Frame frame;
  for (const Bytes& piece : link.pieces) {
    splitter.push(piece);
    while (splitter.next(frame))
      if (frame.kind == kind) out.push_back(frame);
  }
  CHECK(splitter.skipped_bytes() == 0);
  return out;
}

inline std::string bench17_text() {
  return testing::source_text("sim/rigs/bench17.json");
}

/// bench17 with replaced values, each as JSON text: {"/simulation/slack_mm", "2"}.
std::string bench17_with(const std::vector<std::pair<std::string, std::string>>& changes);

inline std::unique_ptr<Rig> make_rig(const std::string& rig_json, std::uint64_t seed) {
  auto rig = Rig::create(rig_json, fabrics_text(), seed);
  if (!rig) throw std::runtime_error(to_string(rig.error()));
  return std::move(*rig);
}

}  // namespace weft::sim::test
