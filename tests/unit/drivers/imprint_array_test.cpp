// The driver of an imprint array: identity, the requested part, published scans, faults.

#include <catch2/catch.hpp>
#include <memory>

#include "drivers/imprint_array/imprint_driver.hpp"
#include "protocols/imprint/imprint.hpp"
#include "tests/unit/allocations.hpp"
#include "tests/unit/drivers/fakes.hpp"

namespace imprint_array_test {

using namespace weft;
using namespace weft::testing;
namespace imprint = protocols::imprint;

namespace {

constexpr imprint::Window middle{48, 48, 32, 32}, whole{0, 0, 128, 128};

imprint::Frame description_frame() {
  imprint::Frame frame;
  frame.description = {.serial = 86000001,
                       .firmware = {1, 2, 3},
                       .rows = 128,
                       .cols = 128,
                       .bits = 7,
                       .spacing_um = 280,
                       .full_scale_pa = 127000,
                       .period_us = 200000};
  return frame;
}

imprint::Frame scan_frame(unsigned number, const imprint::Window& window = middle) {
  imprint::Frame frame;
  frame.kind = imprint::Kind::scan;
  frame.sequence = static_cast<std::uint16_t>(number);
  frame.device_us = number * 200000U;
  frame.window = window;
  for (std::size_t i = 0; i < window.taxels(); ++i)
    frame.counts[i] = static_cast<std::uint8_t>((i + number) % 128);
  return frame;
}

struct Bench : DriverBench {
  explicit Bench(const std::string& config = R"({"rows": 32, "cols": 32})")
      : DriverBench(drivers::imprint_array_entry, config) {}
  using DriverBench::receive;
  void receive(const imprint::Frame& frame) {
    Bytes bytes;
    append(bytes, frame);
    receive(bytes);
  }
  std::vector<imprint::Window> requested() {
    imprint::Splitter splitter;
    splitter.push(host.link_.take_written());
    std::vector<imprint::Window> out;
    for (imprint::Frame frame; splitter.next(frame);) {
      REQUIRE(frame.kind == imprint::Kind::request);
      out.push_back(frame.window);
    }
    return out;
  }
  void arm() {
    REQUIRE(driver->open());
    receive(description_frame());
    receive(scan_frame(10));
    REQUIRE(driver->arm());
    receive(scan_frame(11));
    REQUIRE(driver->state() == DriverState::armed);
    host.samples.clear();
    static_cast<void>(requested());
  }
};

std::string refusal(const std::string& config) {
  FakeHost host;
  const auto made = drivers::imprint_array_entry.create(config, host);
  REQUIRE_FALSE(made);
  return to_string(made.error());
}

}  // namespace

TEST_CASE("an imprint array opens on its description and a scan of the part that was asked for") {
  Bench bench;
  REQUIRE(bench.driver->open());
  bench.receive(scan_frame(1, whole));  // the array has not identified itself yet
  CHECK(bench.requested().empty());
  bench.receive(description_frame());
  CHECK(bench.requested() == std::vector{middle});
  CHECK(bench.driver->state() == DriverState::closed);
  bench.receive(scan_frame(2, whole));  // already under way
  CHECK(bench.driver->state() == DriverState::closed);
  bench.receive(scan_frame(3));
  CHECK(bench.driver->state() == DriverState::open);
  REQUIRE(bench.host.identities.size() == 1);
  CHECK(
      to_json(bench.host.identities[0]) ==
      R"({"reported":{"array":"128 x 128","bits":"7","cols":"32","firmware":"1.2.3","first_col":"48","first_row":"48","rows":"32","serial":"86000001","spacing_um":"280"},"scale":{"pa_per_count":1000.0}})");
  CHECK(bench.host.samples.empty());
  REQUIRE(bench.driver->arm());
  bench.receive(scan_frame(4));
  REQUIRE(bench.host.samples.size() == 1);
  CHECK(bench.host.samples[0].sequence == 4);
  CHECK(std::get<TaxelSample>(bench.host.samples[0].value).device_us == 800000);
  REQUIRE(bench.host.taxel_counts.size() == 1024);
  CHECK(bench.host.taxel_counts[0] == 4);
  CHECK(bench.host.taxel_counts[1000] == (1000 + 4) % 128);
}

TEST_CASE("the part may lie anywhere on the array, and nowhere else") {
  Bench corner(R"({"rows": 2, "cols": 128, "first_row": 126})");
  REQUIRE(corner.driver->open());
  corner.receive(description_frame());
  CHECK(corner.requested() == std::vector{imprint::Window{126, 0, 2, 128}});
  Bench beyond(R"({"rows": 32, "cols": 32, "first_row": 90})");
  REQUIRE(beyond.driver->open());
  imprint::Frame small = description_frame();
  small.description.rows = 100;
  beyond.receive(small);
  CHECK(beyond.fault().code == Errc::device_settings);
  CHECK(beyond.fault().where == "/rows");
  CHECK(beyond.fault().got.find("row 90") != std::string::npos);
}

TEST_CASE("lost scans are counted, damaged ones and those of another part among them") {
  Bench bench;
  bench.arm();
  bench.receive(scan_frame(14));
  REQUIRE(bench.host.samples.size() == 1);
  CHECK(bench.host.samples[0].lost == 2);
  bench.receive(scan_frame(15, whole));
  CHECK(bench.requested() == std::vector{middle});  // once more
  bench.receive(scan_frame(16));
  REQUIRE(bench.host.samples.size() == 2);
  CHECK(bench.host.samples[1].lost == 1);
  bench.receive(scan_frame(0));
  CHECK(bench.host.samples.back().lost == 0);
  CHECK(bench.host.logs.back().find("restarted") != std::string::npos);
  for (unsigned i = 1; i <= 4; ++i) bench.receive(scan_frame(i, whole));
  CHECK(bench.fault().code == Errc::device_refused);
  CHECK(bench.fault().where == "/rows");
}

TEST_CASE("the description of an imprint array must match the configuration and stay the same") {
  const auto fault_of = [](const std::string& config, const imprint::Frame& description) {
    Bench bench(config);
    REQUIRE(bench.driver->open());
    bench.receive(description);
    return Error(bench.fault());
  };
  const std::string part = R"({"rows": 32, "cols": 32)";
  const Error serial = fault_of(part + R"(, "serial": 7})", description_frame());
  CHECK(serial.code == Errc::device_identity);
  CHECK(serial.where == "/serial");
  CHECK(serial.got == "86000001");
  const Error rate = fault_of(part + R"(, "rate_hz": 6})", description_frame());
  CHECK(rate.code == Errc::device_settings);
  CHECK(rate.where == "/rate_hz");
  imprint::Frame absurd = description_frame();
  absurd.description.period_us = 0;
  const Error no_period = fault_of(part + "}", absurd);
  CHECK(no_period.code == Errc::device_data);
  CHECK(no_period.got.find(" 0 us") != std::string::npos);
  for (const std::uint8_t side : {std::uint8_t{0}, std::uint8_t{130}, std::uint8_t{255}}) {
    imprint::Frame vast = description_frame();
    vast.description.rows = vast.description.cols = side;
    const std::string size = std::to_string(side) + " x " + std::to_string(side);
    CHECK(fault_of(part + "}", vast).code == Errc::device_data);
    CHECK(fault_of(part + "}", vast).got.ends_with(size));
    CHECK(fault_of(R"({"rows": 128, "cols": 128})", vast).code == Errc::device_data);
    CHECK(fault_of(R"({"rows": 128, "cols": 128})", vast).got.ends_with(size));
  }
  Bench bench;
  bench.arm();
  bench.receive(description_frame());
  CHECK(bench.driver->state() == DriverState::armed);
  imprint::Frame other = description_frame();
  other.description.serial = 5;
  bench.receive(other);
  CHECK(bench.fault().code == Errc::device_restarted);
  CHECK(bench.fault().got == "serial 5");
}

TEST_CASE("an imprint array that falls silent is a fault, with what was awaited") {
  Bench mute;
  REQUIRE(mute.driver->open());
  mute.host.loop_.run_for(3.1);
  CHECK(mute.fault().code == Errc::timeout);
  CHECK(mute.fault().what.find("description") != std::string::npos);
  Bench without_scans;
  REQUIRE(without_scans.driver->open());
  without_scans.receive(description_frame());
  without_scans.host.loop_.run_for(3.1);
  CHECK(without_scans.fault().code == Errc::timeout);
  CHECK(without_scans.fault().expected.find("32 x 32") != std::string::npos);
  Bench armed;
  armed.arm();
  armed.receive(scan_frame(12));
  armed.host.loop_.run_for(1.1);
  CHECK(armed.fault().code == Errc::timeout);
  CHECK(armed.fault().expected.find("32 x 32") != std::string::npos);
}

TEST_CASE("frozen scans are seen, those of a few taxels are believed") {
  const auto faulted = [](const std::string& config, const imprint::Window& window) {
    Bench bench(config);
    REQUIRE(bench.driver->open());
    bench.receive(description_frame());
    bench.receive(scan_frame(0, window));
    REQUIRE(bench.driver->arm());
    for (unsigned i = 1; i < 40 && bench.host.faults.empty(); ++i) {
      bench.host.loop_.run_for(0.2);
      imprint::Frame scan = scan_frame(i, window);
      scan.counts.fill(9);
      bench.receive(scan);
    }
    return !bench.host.faults.empty() &&
           bench.host.faults[0].what.find("frozen") != std::string::npos;
  };
  CHECK(faulted(R"({"rows": 32, "cols": 32})", middle));
  CHECK_FALSE(faulted(R"({"rows": 32, "cols": 32, "watch_s": 0})", middle));
  CHECK_FALSE(faulted(R"({"rows": 1, "cols": 1})", {63, 63, 1, 1}));
}

TEST_CASE("an imprint array takes no command, and its configuration is read strictly") {
  Bench bench;
  bench.arm();
  const auto answer = bench.driver->command(HomeCommand{});
  REQUIRE_FALSE(answer);
  CHECK(answer.error().code == Errc::unsupported);
  CHECK(refusal("{}").find("/rows") != std::string::npos);
  CHECK(refusal(R"({"rows": 32})").find("/cols") != std::string::npos);
  CHECK(refusal(R"({"rows": 129, "cols": 1})").find("/rows") != std::string::npos);
  CHECK(refusal(R"({"rows": 32, "cols": 32, "first_row": 100})").find("/first_row") !=
        std::string::npos);
  CHECK(refusal(R"({"rows": 32, "cols": 32, "taxels": 3})").find("/taxels") != std::string::npos);
}

TEST_CASE("an imprint stream allocates nothing") {
  Bench bench;
  bench.arm();
  std::vector<Bytes> frames;
  for (unsigned i = 12; i < 60; ++i) {
    frames.emplace_back();
    append(frames.back(), scan_frame(i));
  }
  bench.host.record = false;
  for (std::size_t i = 0; i < 8; ++i) bench.host.link_.deliver(frames[i], bench.host.loop_.now());
  const std::size_t before = allocations();
  for (std::size_t i = 8; i < frames.size(); ++i)
    bench.host.link_.deliver(frames[i], bench.host.loop_.now());
  CHECK(allocations() - before == 0);
  CHECK(bench.host.published == 49);
}

}  // namespace imprint_array_test
