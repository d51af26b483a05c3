// Faults in the form of a rig file and of an order.

#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "sim/devices/emulator.hpp"
#include "tests/unit/sim/support.hpp"

namespace fault_config_test {

using namespace weft;
using namespace weft::sim;

namespace {

std::string refusal(const std::string& fault) {
  const auto rig = Rig::create(test::bench17_with({{"/simulation/faults", "[" + fault + "]"}}),
                               test::fabrics_text(), 1);
  return rig ? "" : to_string(rig.error());
}

bool says(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

/// Sends given bytes when it is woken, and keeps the received ones.
struct Parrot final : Emulator {
  void receive(ByteView bytes, TimePoint, ByteSink& out) override {
    received.emplace_back(bytes.begin(), bytes.end());
    out(bytes);
  }
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override { return std::nullopt; }
  void wake(TimePoint, ByteSink&) override {}
  std::vector<Bytes> received;
};

struct Wire {
  explicit Wire(FaultyWire::Kind kind) : wire(std::make_unique<Parrot>(), board, kind, {}) {}
  void send(std::uint8_t number) {
    const Bytes message(4, number);
    wire.receive(message, now, sink);
  }
  void run(double seconds) {
    const TimePoint end = now + from_seconds(seconds);
    for (auto at = wire.next_wakeup(); at && *at <= end; at = wire.next_wakeup())
      wire.wake(now = std::max(now, *at), sink);
    now = end;
  }
  FaultBoard board{7};
  TimePoint now{};
  std::vector<Bytes> came;
  ByteSink sink = [this](ByteView bytes) { came.emplace_back(bytes.begin(), bytes.end()); };
  FaultyWire wire;
};

Fault fault(FaultKind kind, double amount = 0) {
  return {.kind = kind, .amount = amount};
}

}  // namespace

TEST_CASE("faults of a rig file are refused with a place and what there is instead") {
  CHECK(refusal(R"({"device": "ft", "fault": "drop", "probability": 0.1, "start_s": 5})").empty());
  CHECK(says(refusal(R"({"device": "ft", "fault": "dropp"})"), "/simulation/faults/0/fault"));
  CHECK(says(refusal(R"({"device": "ft", "fault": "dropp"})"), "stuck_force"));
  CHECK(says(refusal(R"({"device": "ft", "fault": "merge"})"), "/simulation/faults/0"));
  CHECK(says(refusal(R"({"device": "stage.q", "fault": "drop"})"), "/device"));
  CHECK(says(refusal(R"({"device": "ft", "fault": "drop", "probability": 1.5})"), "/probability"));
  CHECK(says(refusal(R"({"device": "ft", "fault": "drop", "wen": 1})"), "/wen"));
  CHECK(says(refusal(R"({"device": "ft", "fault": "stuck_force", "towards": "device"})"),
             "/towards"));
  CHECK(says(refusal(R"({"device": "ft", "fault": "drop", "towards": "me"})"), "/towards"));
  CHECK(says(refusal("7"), "/simulation/faults/0"));
}

TEST_CASE("orders at run time are checked as the rig file is") {
  const auto rig = test::make_rig(test::bench17_text(), 1);
  CHECK(rig->inject(R"({"device": "ft", "fault": "drop"})", {}));
  CHECK_FALSE(rig->inject("no JSON", {}));
  CHECK_FALSE(rig->inject(R"({"device": "taxels", "fault": "motor_stall"})", {}));
  CHECK(rig->clear_faults("ft", "drop"));
  CHECK(rig->clear_faults("ft", ""));
  CHECK_FALSE(rig->clear_faults("ft", "dropp"));
  CHECK_FALSE(rig->clear_faults("nobody", ""));
}

TEST_CASE("a stream keeps its order whatever the delay, datagrams overtake") {
  for (const auto kind : {FaultyWire::Kind::stream, FaultyWire::Kind::datagram}) {
    Wire wire(kind);
    wire.board.add(fault(FaultKind::jitter, 0.1));
    for (std::uint8_t i = 0; i < 100; ++i) {
      wire.send(i);
      wire.run(0.001);
    }
    wire.run(1);
    Bytes all;
    for (const Bytes& piece : wire.came) all.insert(all.end(), piece.begin(), piece.end());
    REQUIRE(all.size() == 400);
    CHECK(std::is_sorted(all.begin(), all.end()) == (kind == FaultyWire::Kind::stream));
  }
}

TEST_CASE("a stalled link gives all back when it is cleared, a plug that is out nothing") {
  Wire wire(FaultyWire::Kind::datagram);
  wire.board.add(fault(FaultKind::link_stall));
  wire.send(1);
  wire.run(10);
  CHECK(wire.came.empty());
  wire.board.clear();
  wire.wire.wake(wire.now, wire.sink);
  CHECK(wire.came == std::vector<Bytes>{Bytes(4, 1)});
  wire.board.add(fault(FaultKind::unplug));
  wire.send(2);
  wire.board.clear();
  wire.run(1);
  CHECK(wire.came.size() == 1);
}

TEST_CASE("merge makes lumps, split single bytes, and neither loses one") {
  Wire merged(FaultyWire::Kind::stream);
  merged.board.add(fault(FaultKind::merge, 0.05));
  for (std::uint8_t i = 0; i < 10; ++i) {
    merged.send(i);
    merged.run(0.01);
  }
  merged.run(1);
  CHECK(merged.came.size() <= 3);
  Wire split(FaultyWire::Kind::stream);
  split.board.add(fault(FaultKind::split));
  split.send(9);
  CHECK(split.came == std::vector<Bytes>(4, Bytes{9}));
}

TEST_CASE("a board without faults throws no dice, and windows open and close in time") {
  FaultBoard board(3);
  Random fresh(3);
  CHECK(board.fires(FaultKind::drop, {}) == nullptr);
  CHECK(board.dice().bits() == fresh.bits());
  Fault late = fault(FaultKind::drop);
  late.from = TimePoint(std::chrono::seconds(1));
  late.until = TimePoint(std::chrono::seconds(2));
  board.add(late);
  CHECK(board.active(FaultKind::drop, {}) == nullptr);
  CHECK(board.next_edge({}) == late.from);
  CHECK(board.active(FaultKind::drop, late.from) != nullptr);
  CHECK(board.next_edge(late.from) == late.until);
  CHECK(board.active(FaultKind::drop, late.until) == nullptr);
}

}  // namespace fault_config_test
