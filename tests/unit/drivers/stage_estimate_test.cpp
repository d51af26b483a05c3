// The statuses of a stage that its driver accepts.

#include <cmath>

#include "tests/unit/drivers/stage_bench.hpp"

namespace stage_estimate_test {

using namespace weft;
using namespace weft::testing;

namespace {

constexpr std::uint32_t fault_bits[] = {0x4000U,     0x8000U,     0x20000U,    0x40000U,
                                        0x80000U,    0x01000000U, 0x02000000U, 0x04000000U,
                                        0x08000000U, 0x40000000U};

const Bytes request_status = hex("80 04 01 00 50 01");

/// After `wait_s`, a status of a moving stage.
void receive_at(StageBench& bench, double wait_s, double place_mm) {
  bench.loop().run_for(wait_s);
  bench.receive_status(static_cast<std::int32_t>(std::lround(place_mm * 1e-3 * counts_per_m)),
                       moving_homed);
}

}  // namespace

TEST_CASE("every fault bit, in two statuses in a row, faults the driver and stops the stage") {
  for (const std::uint32_t bit : fault_bits) {
    StageBench bench = StageBench::lts();
    bench.arm_lts();
    bench.receive_status(0, idle_homed | bit);
    CHECK(bench.link().take_written() == request_status);  // at once, before the next poll
    bench.receive_status(0, idle_homed | bit);
    CHECK(bench.fault_code() == Errc::device);
    CHECK(bench.link().take_written() == hex("65 04 01 01 50 01"));
    CHECK(bench.loop().timers() == 0);
    CHECK_FALSE(bench.link().listened_to());
  }
}

TEST_CASE("one damaged status word is dropped: the stage stays armed and moves") {
  constexpr std::uint32_t disabled = idle_homed & 0x7FFFFFFF;
  std::vector<std::uint32_t> damaged{disabled, idle_not_homed, 0};
  for (const std::uint32_t bit : fault_bits) damaged.push_back(idle_homed | bit);
  for (const std::uint32_t word : damaged) {
    INFO(word);
    StageBench bench = StageBench::lts();
    bench.arm_lts();
    for (int i = 0; i < 3; ++i) {
      bench.receive_status(0, word);
      CHECK(bench.host.samples.empty());
      CHECK(bench.driver->command(MoveCommand{0.01, 0.01}));
      bench.receive_status(0, idle_homed);
      CHECK(bench.host.samples.size() == 1);
      bench.host.samples.clear();
    }
    CHECK(bench.host.faults.empty());
  }
}

TEST_CASE("an end of a move with a damaged status word still counts") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  const std::uint32_t id = bench.driver->command(MoveCommand{0.01, 0.01}).value();
  bench.receive_completed(4096000, idle_homed | fault_bits[0]);
  CHECK(bench.host.samples.empty());
  bench.receive_status(4096000, idle_homed);
  CHECK(bench.last_sample().move_id == id);
  CHECK(bench.host.faults.empty());
}

TEST_CASE("a stage that has lost its home is believed at the second status, and refuses motion") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  for (int i = 0; i < 2; ++i) bench.receive_status(0, idle_not_homed);
  CHECK_FALSE(bench.last_sample().homed);
  CHECK(bench.driver->command(MoveCommand{0.01, 0.01}).error().code == Errc::wrong_state);
  CHECK(bench.host.faults.empty());
}

TEST_CASE("three positions in a row that no motion explains are a fault, one is dropped") {
  StageBench bench = StageBench::lts(R"(, "check_jumps": true)");
  bench.arm_lts();
  const auto receive_after_20_ms = [&](double mm) { receive_at(bench, 0.02, mm); };
  receive_after_20_ms(0.08);
  receive_after_20_ms(90);  // damaged
  receive_after_20_ms(0.16);
  CHECK(bench.host.faults.empty());
  for (int i = 0; i < 3; ++i) receive_after_20_ms(90);
  CHECK(bench.fault_code() == Errc::device_data);
}

TEST_CASE("a host that was held up takes an old reading and the next one for motion, not a jump") {
  constexpr double speed_mm_s = 30;
  for (const double held_up_s : {0.12, 0.24, 2.0}) {
    INFO(held_up_s);
    StageBench bench = StageBench::lts(R"(, "check_jumps": true)");
    bench.arm_lts();
    receive_at(bench, 0.02, speed_mm_s * 0.02);
    receive_at(bench, held_up_s, speed_mm_s * 0.03);  // sent 10 ms after the previous one
    for (int i = 1; i <= 3; ++i)
      receive_at(bench, 1e-3, speed_mm_s * (0.02 + held_up_s + 1e-3 * i));
    CHECK(bench.host.faults.empty() == (held_up_s < 0.25));  // a longer delay ends the run
  }
}

}  // namespace stage_estimate_test
