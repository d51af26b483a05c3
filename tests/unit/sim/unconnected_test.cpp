// Devices without a host: they send nothing, and a later host sees no difference.

#include <nlohmann/json.hpp>

#include "tests/unit/sim/support.hpp"

namespace unconnected_test {

using namespace weft;
using namespace weft::sim;
using namespace std::chrono_literals;
using nlohmann::json;

namespace {

/// bench17 with taxel frames in pieces, and a vibration sensor as its eighth device.
json sensing_bench() {
  json rig = json::parse(test::bench17_with({{"/devices/2/emulator/start_mm", "62"}}));
  rig["devices"][6]["emulator"]["largest_chunk_bytes"] = 7;
  rig["devices"].push_back({{"name", "vibro"},
                            {"role", "vibro"},
                            {"driver", "vibro"},
                            {"emulator", {{"kind", "vibro"}, {"largest_chunk_bytes", 11}}}});
  return rig;
}

/// The device `name` of a rig, switched on at time zero.
struct Bench {
  Bench(const json& rig_json, const std::string& device)
      : name(device), rig(test::make_rig(rig_json.dump(), 3)), link(loop) {
    REQUIRE(rig->attach(name, link, loop));
  }
  void mount_at(TimePoint when) {
    loop.run_to(when);
    REQUIRE(rig->mount("denim", 4, when));
  }
  void inject_at(TimePoint when, const char* fault, double amount) {
    loop.run_to(when);
    const json order{{"device", name}, {"fault", fault}, {"amount", amount}, {"duration_s", 0.2}};
    REQUIRE(rig->inject(order.dump(), when));
  }
  /// Bytes that it sends between two times.
  std::vector<Bytes> pieces_between(TimePoint from, TimePoint to) {
    loop.run_to(from);
    const auto before = static_cast<std::ptrdiff_t>(link.pieces.size());
    rig->set_connected(name, true);
    loop.run_to(to);
    return {link.pieces.begin() + before, link.pieces.end()};
  }

  std::string name;
  test::TestLoop loop;
  std::unique_ptr<Rig> rig;
  test::TestLink link;
};

constexpr TimePoint mounted{1'234'567'891ns}, connected{2'345'678'901ns}, end{3'500ms};

}  // namespace

TEST_CASE("devices without a connected host have no timers and send nothing") {
  const json rig_json = sensing_bench();
  auto rig = test::make_rig(rig_json.dump(), 3);
  test::TestLoop loop;
  std::vector<std::unique_ptr<test::TestLink>> links;
  for (const json& device : rig_json["devices"]) {
    links.push_back(std::make_unique<test::TestLink>(loop));
    REQUIRE(rig->attach(device["name"].get<std::string>(), *links.back(), loop));
    rig->set_connected(device["name"].get<std::string>(), false);
  }
  CHECK(loop.timers() == 0);
  loop.run_for(2);
  rig->keep_up(loop.now());
  CHECK(loop.timers() == 0);
  for (const auto& link : links) CHECK(link->pieces.empty());
}

TEST_CASE("a late connection continues with the bytes that it would have had") {
  for (const char* device : {"taxels", "vibro"}) {
    CAPTURE(device);
    Bench always(sensing_bench(), device), late(sensing_bench(), device),
        kept_up(sensing_bench(), device);
    for (Bench* bench : {&late, &kept_up}) bench->rig->set_connected(device, false);
    for (Bench* bench : {&always, &late, &kept_up}) bench->mount_at(mounted);
    for (const auto at : {1'300ms, 1'301ms, 2'345ms}) {
      kept_up.loop.run_to(TimePoint(at));
      kept_up.rig->keep_up(TimePoint(at));
    }
    const auto pieces = always.pieces_between(connected, end);
    REQUIRE(pieces.size() > 100);
    CHECK(late.pieces_between(connected, end) == pieces);
    CHECK(kept_up.pieces_between(connected, end) == pieces);
  }
}

TEST_CASE("a fault finds an unheard device as it would have been") {
  for (const auto& [fault, amount] : {std::pair{"sequence_jump", 5.0}, {"frozen_frame", 0.0}}) {
    CAPTURE(fault);
    Bench always(sensing_bench(), "taxels"), late(sensing_bench(), "taxels");
    late.rig->set_connected("taxels", false);
    for (Bench* bench : {&always, &late}) {
      bench->mount_at(mounted);
      bench->inject_at(TimePoint(1'500ms), fault, amount);
    }
    CHECK(late.loop.timers() == 1);
    CHECK(late.pieces_between(TimePoint(1'600ms), end) ==
          always.pieces_between(TimePoint(1'600ms), end));
  }
}

TEST_CASE("bytes from a host are a sign that it receives") {
  Bench bench(sensing_bench(), "taxels");
  bench.rig->set_connected("taxels", false);
  bench.loop.run_for(1);
  bench.link.send(test::hex("01"));
  CHECK(bench.loop.timers() == 1);
  bench.loop.run_for(0.1);
  CHECK_FALSE(bench.link.pieces.empty());
}

}  // namespace unconnected_test
