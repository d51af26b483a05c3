// Every fault before every driver that it can befall: what the driver makes of it. The table is
// printed.

#include <catch2/catch.hpp>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <map>
#include <set>
#include <utility>

#include "sim/devices/faults/fault.hpp"
#include "tests/unit/faults/fault_bench.hpp"

using namespace weft;
using namespace weft::testing;

namespace {

enum class Outcome {
  reported,   ///< the driver faults with this sentence, within the bound
  marked,     ///< samples are flagged: lost, not valid, or a line of the log
  right,      ///< harmless by design: nothing wrong is published, the work goes on
  safe,       ///< no check value on this wire: right data or a fault, nothing wild
  elsewhere,  ///< no driver can see it; the note says who does
};

const char* name_of(Outcome outcome) {
  constexpr const char* names[] = {"reported", "marked", "right", "safe", "elsewhere"};
  return names[static_cast<int>(outcome)];
}

struct Row {
  const char* device;
  const char* fault;
  const char* more;  ///< members of the fault's JSON
  Outcome outcome;
  const char* says;  ///< in the error, the log, or a note
  double bound_s;
  bool before_opening = false;
};

using enum Outcome;

const Row rows[] = {
    // stepper on a serial line; polled at 100 Hz
    {"lts", "drop", R"("probability": 0.3)", right, "asked again", 10},
    {"lts", "drop", R"("towards": "device", "probability": 1)", reported, "does not answer", 1.5},
    {"lts", "truncate", R"("probability": 0.1)", safe, "resynchronised; jumps dropped", 10},
    {"lts", "bit_flip", R"("probability": 0.1)", safe, "jumps dropped; no check value", 10},
    {"lts", "garbage", R"("probability": 0.2)", safe, "resynchronised", 10},
    {"lts", "delay", R"("amount": 0.05)", right, "asked ahead", 10},
    {"lts", "delay", R"("amount": 2)", reported, "does not answer", 1.5},
    {"lts", "jitter", "", right, "order is kept", 10},
    {"lts", "unplug", "", reported, "does not answer", 1.5},
    {"lts", "unplug", R"("duration_s": 0.3)", right, "replugged; commands and polls go on", 10},
    {"lts", "link_stall", R"("duration_s": 0.5)", right, "late, in order", 10},
    {"lts", "link_stall", "", reported, "does not answer", 1.5},
    {"lts", "merge", "", right, "any chunking", 10},
    {"lts", "split", "", right, "any chunking", 10},
    {"lts", "motor_stall", "", reported, "does not move", 4},
    {"lts", "lost_steps", "", elsewhere, "no encoder: homing again shows it", 10},
    {"lts_encoder", "lost_steps", "", reported, "steps were lost", 2},
    {"lts", "limit_switch", "", reported, "stopped before its target", 0.5},
    {"lts", "motion_error", "", reported, "position error too large", 0.5},
    {"lts", "over_temperature", "", reported, "over-temperature", 0.5},
    {"lts", "disabled", "", reported, "fallen disabled", 0.5},
    {"lts", "silent_status", "", reported, "does not answer", 1.5},
    {"lts", "wrong_reply", "", reported, "does not answer", 1.5},
    {"lts", "late_completion", R"("amount": 0.5)", right, "waited for", 10},
    {"lts", "no_completion", "", right, "the status says so too", 10},
    {"lts", "wrong_serial", "", reported, "another serial number", 1, true},
    {"lts", "never_homes", "", reported, "does not move", 12, true},
    {"lts", "false_home", "", reported, "never moved", 2, true},
    {"lts", "encoder_frozen", "", reported, "away from its target", 4},
    {"lts", "overshoot", "", reported, "away from its target", 3},
    // servo
    {"prm", "drop", R"("probability": 0.3)", right, "asked again", 10},
    {"prm", "truncate", R"("probability": 0.1)", safe, "resynchronised; jumps dropped", 10},
    {"prm", "bit_flip", R"("probability": 0.1)", safe, "jumps dropped; no check value", 10},
    {"prm", "garbage", R"("probability": 0.2)", safe, "resynchronised", 10},
    {"prm", "delay", R"("amount": 0.05)", right, "asked ahead", 10},
    {"prm", "jitter", "", right, "order is kept", 10},
    {"prm", "unplug", "", reported, "does not answer", 1.5},
    {"prm", "link_stall", R"("duration_s": 0.5)", right, "late, in order", 10},
    {"prm", "merge", "", right, "any chunking", 10},
    {"prm", "split", "", right, "any chunking", 10},
    {"prm", "motor_stall", "", reported, "took too long", 4},
    {"prm", "lost_steps", "", right, "its loop is closed on the encoder", 10},
    {"prm", "limit_switch", "", reported, "stopped before its target", 0.5},
    {"prm", "motion_error", "", reported, "position error too large", 0.5},
    {"prm", "over_temperature", "", reported, "over-temperature", 0.5},
    {"prm", "disabled", "", reported, "fallen disabled", 0.5},
    {"prm", "silent_status", "", reported, "does not answer", 1.5},
    {"prm", "wrong_reply", "", reported, "does not answer", 1.5},
    {"prm", "late_completion", R"("amount": 0.5)", right, "waited for", 10},
    {"prm", "no_completion", "", right, "the status says so too", 10},
    {"prm", "wrong_serial", "", reported, "another serial number", 1, true},
    {"prm", "never_homes", "", reported, "does not move", 12, true},
    {"prm", "false_home", "", reported, "never moved", 2, true},
    {"prm", "encoder_frozen", "", reported, "away from its target", 4},
    {"prm", "overshoot", "", reported, "away from its target", 4},
    // force sensor over UDP, 100 records a second
    {"ft", "drop", R"("probability": 0.2)", marked, "lost", 10},
    {"ft", "duplicate", R"("probability": 0.2)", marked, "came twice", 10},
    {"ft", "reorder", R"("probability": 0.1)", marked, "lost", 10},
    {"ft", "truncate", R"("probability": 0.1)", marked, "lost", 10},
    {"ft", "bit_flip", R"("probability": 0.02)", elsewhere, "UDP's checksum drops such datagrams",
     10},
    {"ft", "garbage", R"("probability": 0.1)", marked, "lost", 10},
    {"ft", "delay", "", right, "late, in order", 10},
    {"ft", "jitter", "", marked, "lost", 10},
    {"ft", "unplug", "", reported, "no record came", 0.5},
    {"ft", "unplug", R"("duration_s": 0.05)", marked, "lost", 10},
    {"ft", "link_stall", "", reported, "no record came", 0.5},
    {"ft", "sequence_jump", "", marked, "lost", 10},
    {"ft", "sequence_back", "", reported, "restarted", 0.5},
    {"ft", "rate_halved", "", reported, "another rate", 7},
    {"ft", "silent", "", reported, "no record came", 0.5},
    {"ft", "redirected", "", reported, "no record came", 0.5},
    {"ft", "stuck_force", "", reported, "stuck", 1.5},
    {"ft", "drift", "", elsewhere, "bias before each trial", 10},
    {"ft", "saturation", "", marked, "not valid", 10},
    {"ft", "absurd_counts", R"("probability": 0.3)", marked, "not valid", 10},
    {"ft", "calibration_change", "", elsewhere, "seen where the box's page is read", 10},
    {"ft_page", "calibration_change", "", reported, "another scale", 1, true},
    {"ft", "status_bits", "", marked, "not valid", 10},
    {"ft", "threshold_latch", "", right, "the values are valid", 10},
    {"ft", "bias_jump", "", elsewhere, "force guards and the bias before each trial", 10},
    {"ft", "noise", "", elsewhere, "force quality of the report", 10},
    // Digital F/T on a serial line: 100 records of 13 bytes a second, their sum of 7 bits
    {"digital", "drop", R"("probability": 0.2)", elsewhere, "no number on this wire", 10},
    {"digital", "drop", R"("probability": 0.5)", reported, "another rate", 7},
    {"digital", "drop", R"("towards": "device", "probability": 1)", right, "it only listens", 10},
    {"digital", "drop", R"("probability": 0.3, "duration_s": 0.6)", right, "asked again", 10, true},
    {"digital", "drop", R"("towards": "device", "probability": 1)", reported, "does not answer", 2,
     true},
    {"digital", "truncate", R"("probability": 0.02)", marked, "lost", 10},
    {"digital", "bit_flip", R"("probability": 0.02)", marked, "lost", 10},
    {"digital", "garbage", R"("probability": 0.02)", marked, "lost", 10},
    {"digital", "delay", "", right, "late, in order", 10},
    {"digital", "delay", R"("amount": 0.15)", right, "late answers are not mixed up", 10, true},
    {"digital", "jitter", "", right, "order is kept", 10},
    {"digital", "unplug", "", reported, "no record came", 0.5},
    {"digital", "unplug", R"("duration_s": 0.05)", elsewhere, "no number on this wire", 10},
    {"digital", "unplug", "", reported, "does not answer", 2, true},
    {"digital", "link_stall", R"("duration_s": 0.05)", right, "late, in order", 10},
    {"digital", "link_stall", "", reported, "no record came", 0.5},
    {"digital", "merge", "", right, "any chunking", 10},
    {"digital", "split", "", right, "any chunking", 10},
    {"digital", "rate_halved", "", reported, "another rate", 7},
    {"digital", "silent", "", reported, "no record came", 0.5},
    {"digital", "silent", "", reported, "no record came", 1, true},
    {"digital", "stuck_force", "", reported, "stuck", 1.5},
    {"digital", "drift", "", elsewhere, "bias before each trial", 10},
    {"digital", "saturation", "", marked, "not valid", 10},
    {"digital", "absurd_counts", R"("probability": 0.3)", marked, "not valid", 10},
    {"digital", "calibration_change", "", elsewhere, "seen when it is opened", 10},
    {"digital", "calibration_change", "", reported, "another calibration", 2, true},
    {"digital", "status_bits", "", marked, "not valid", 10},
    {"digital", "status_bits", R"("amount": 2)", reported, "reports a fault", 1, true},
    {"digital", "bias_jump", "", elsewhere, "force guards and the bias before each trial", 10},
    {"digital", "noise", "", elsewhere, "force quality of the report", 10},
    {"digital", "wrong_reply", "", right, "nothing is asked while it streams", 10},
    {"digital", "wrong_reply", "", reported, "does not answer", 2, true},
    {"digital", "crc_errors", R"("probability": 0.02)", marked, "lost", 10},
    {"digital", "crc_errors", "", reported, "only damaged records", 0.5},
    {"digital", "crc_errors", "", reported, "does not answer", 2, true},
    // the same, ten records to a sample
    {"digital_mean", "bit_flip", R"("probability": 0.1)", marked, "lost", 10},
    {"digital_mean", "absurd_counts", R"("probability": 0.02)", marked, "not valid", 10},
    {"digital_mean", "stuck_force", "", reported, "stuck", 1.5},
    {"digital_mean", "rate_halved", "", reported, "another rate", 7},
    {"digital_mean", "split", "", right, "any chunking", 10},
    // tactile array on a serial line
    {"taxels", "drop", R"("probability": 0.2)", marked, "lost", 10},
    {"taxels", "truncate", R"("probability": 0.1)", marked, "lost", 10},
    {"taxels", "bit_flip", R"("probability": 0.1)", marked, "lost", 10},
    {"taxels", "garbage", R"("probability": 0.2)", right, "skipped", 10},
    {"taxels", "delay", "", right, "late, in order", 10},
    {"taxels", "jitter", "", right, "order is kept", 10},
    {"taxels", "unplug", "", reported, "no frame came", 0.6},
    {"taxels", "link_stall", R"("duration_s": 0.2)", right, "late, in order", 10},
    {"taxels", "link_stall", "", reported, "no frame came", 0.6},
    {"taxels", "merge", "", right, "any chunking", 10},
    {"taxels", "split", "", right, "any chunking", 10},
    {"taxels", "sequence_jump", "", marked, "lost", 10},
    {"taxels", "sequence_back", "", marked, "restarted", 10},
    {"taxels", "rate_halved", "", reported, "another rate", 7},
    {"taxels", "silent", "", reported, "no frame came", 0.6},
    {"taxels", "crc_errors", R"("probability": 0.3)", marked, "lost", 10},
    {"taxels", "crc_errors", "", reported, "no frame came", 0.6},
    {"taxels", "dead_pad", "", reported, "taxel 5 is dead", 5},
    {"taxels", "noisy_pad", "", reported, "taxel 5 is noisy", 5},
    {"taxels", "saturated_pad", "", reported, "taxel 5 is saturated", 5},
    {"taxels", "frozen_frame", "", reported, "frozen", 5},
    {"taxels", "half_speed_clock", "", reported, "clock runs wrong", 7},
    {"taxels", "wrong_count", "", reported, "another number of taxels", 0.2},
    {"taxels", "restart", "", marked, "restarted", 10},
    // CPM-Finger over UDP: no numbers, no check value
    {"cpm", "drop", R"("probability": 0.2)", elsewhere, "no number on this wire", 10},
    {"cpm", "duplicate", R"("probability": 0.2)", elsewhere, "no number on this wire", 10},
    {"cpm", "reorder", R"("probability": 0.1)", elsewhere, "no number on this wire", 10},
    {"cpm", "truncate", R"("probability": 0.1)", marked, "damaged", 10},
    {"cpm", "garbage", R"("probability": 0.1)", marked, "damaged", 10},
    {"cpm", "bit_flip", R"("probability": 0.1)", elsewhere, "UDP's checksum drops such datagrams",
     10},
    {"cpm", "jitter", "", right, "late, nothing else", 10},
    {"cpm", "link_stall", R"("duration_s": 0.2)", right, "late, in order", 10},
    {"cpm", "link_stall", "", reported, "no frame came", 0.6},
    {"cpm", "sequence_jump", "", right, "no number on this wire", 10},
    {"cpm", "sequence_back", "", right, "no number on this wire", 10},
    {"cpm", "crc_errors", "", right, "no check value on this wire", 10},
    {"cpm", "half_speed_clock", "", right, "no clock on this wire", 10},
    {"cpm", "wrong_count", "", reported, "no frame came", 0.6},
    {"cpm", "restart", "", right, "no number on this wire", 10},
    {"cpm", "delay", "", right, "late, in order", 10},
    {"cpm", "unplug", "", reported, "no frame came", 0.6},
    {"cpm", "silent", "", reported, "no frame came", 0.6},
    {"cpm", "rate_halved", "", reported, "another rate", 7},
    {"cpm", "dead_pad", "", reported, "taxel 5 is dead", 5},
    {"cpm", "noisy_pad", "", reported, "taxel 5 is noisy", 5},
    {"cpm", "saturated_pad", "", reported, "taxel 5 is saturated", 5},
    {"cpm", "frozen_frame", "", reported, "frozen", 5},
    // vibration sensor on a serial line: 50 blocks a second of each channel
    {"vibro", "drop", R"("probability": 0.2)", marked, "lost", 10},
    {"vibro", "drop", R"("towards": "device", "probability": 1)", right, "it only listens", 10},
    {"vibro", "truncate", R"("probability": 0.1)", marked, "lost", 10},
    {"vibro", "bit_flip", R"("probability": 0.1)", marked, "lost", 10},
    {"vibro", "garbage", R"("probability": 0.2)", right, "skipped", 10},
    {"vibro", "delay", "", right, "late, in order", 10},
    {"vibro", "jitter", "", right, "order is kept", 10},
    {"vibro", "unplug", "", reported, "came from the vibration sensor", 0.5},
    {"vibro", "unplug", R"("duration_s": 0.2)", marked, "lost", 10},
    {"vibro", "unplug", "", reported, "no description", 3.2, true},
    {"vibro", "link_stall", R"("duration_s": 0.2)", right, "late, in order", 10},
    {"vibro", "link_stall", "", reported, "came from the vibration sensor", 0.5},
    {"vibro", "merge", "", right, "any chunking", 10},
    {"vibro", "split", "", right, "any chunking", 10},
    {"vibro", "sequence_jump", "", marked, "lost", 10},
    {"vibro", "sequence_back", "", marked, "restarted", 10},
    {"vibro", "rate_halved", "", reported, "another rate", 7},
    {"vibro", "silent", "", reported, "came from the vibration sensor", 0.5},
    {"vibro", "crc_errors", R"("probability": 0.3)", marked, "lost", 10},
    {"vibro", "crc_errors", "", reported, "came from the vibration sensor", 0.5},
    {"vibro", "saturation", R"("duration_s": 0.5)", marked, "not valid", 10},
    {"vibro", "saturation", "", reported, "saturated", 5},
    {"vibro", "frozen_frame", "", reported, "frozen", 5},
    {"vibro", "half_speed_clock", "", reported, "clock runs wrong", 7},
    {"vibro", "wrong_count", "", reported, "another number of values", 0.2},
    {"vibro", "restart", "", marked, "restarted", 10},
    // the same frames over UDP
    {"vibro_udp", "drop", R"("probability": 0.2)", marked, "lost", 10},
    {"vibro_udp", "duplicate", R"("probability": 0.2)", right, "dropped", 10},
    {"vibro_udp", "reorder", R"("probability": 0.1)", marked, "lost", 10},
    {"vibro_udp", "truncate", R"("probability": 0.1)", marked, "lost", 10},
    {"vibro_udp", "bit_flip", R"("probability": 0.1)", marked, "lost", 10},
    {"vibro_udp", "garbage", R"("probability": 0.2)", right, "skipped", 10},
    {"vibro_udp", "delay", "", right, "late, in order", 10},
    {"vibro_udp", "jitter", R"("amount": 0.08)", marked, "lost", 10},
    {"vibro_udp", "unplug", "", reported, "came from the vibration sensor", 0.5},
    {"vibro_udp", "link_stall", R"("duration_s": 0.2)", right, "late, in order", 10},
    {"vibro_udp", "link_stall", "", reported, "came from the vibration sensor", 0.5},
    {"vibro_udp", "sequence_jump", "", marked, "lost", 10},
    {"vibro_udp", "sequence_back", "", marked, "restarted", 10},
    {"vibro_udp", "rate_halved", "", reported, "another rate", 7},
    {"vibro_udp", "silent", "", reported, "came from the vibration sensor", 0.5},
    {"vibro_udp", "crc_errors", R"("probability": 0.3)", marked, "lost", 10},
    {"vibro_udp", "saturation", R"("duration_s": 0.5)", marked, "not valid", 10},
    {"vibro_udp", "frozen_frame", "", reported, "frozen", 5},
    {"vibro_udp", "half_speed_clock", "", reported, "clock runs wrong", 7},
    {"vibro_udp", "wrong_count", "", reported, "another number of values", 0.2},
    {"vibro_udp", "restart", "", marked, "restarted", 10},
};

/// No sample out of order, none later than now, nothing wild that is not marked. Each kind of
/// sample has numbers of its own.
std::string wrong_with(const FaultBench& bench, const Row& row) {
  const bool sensor = !bench.is_stage();
  std::map<std::size_t, Seen> last;
  for (const Seen& b : bench.samples) {
    const auto [before, first] = last.try_emplace(b.kind, b);
    const Seen a = std::exchange(before->second, b);
    if (first) continue;
    if (b.at < a.at) return "a sample before its time";
    const auto ahead = static_cast<std::int16_t>(b.sequence - a.sequence);
    if (sensor && ahead <= 0 && std::string_view(row.says) != "restarted")
      return "a sample out of order";
  }
  if (row.outcome == elsewhere) return {};
  for (const Seen& s : bench.samples) {
    if (!s.valid) continue;
    if (std::abs(s.value) > bench.largest_believable())
      return "a wild value: " + std::to_string(s.value);
  }
  return {};
}

bool is_marked(const FaultBench& bench, std::string_view how, std::size_t from) {
  for (std::size_t i = from; i < bench.samples.size(); ++i) {
    if (how == "lost" && bench.samples[i].lost > 0) return true;
    if (how == "not valid" && !bench.samples[i].valid) return true;
  }
  for (const std::string& line : bench.logs)
    if (line.find(how) != std::string::npos) return true;
  return false;
}

struct Found {
  double after_s = 0;  ///< from the onset to the fault
  std::string wrong;   ///< empty: as the row says
};

std::string judged(const FaultBench& bench, const Row& row, std::size_t from, double after_s) {
  if (const std::string wrong = wrong_with(bench, row); !wrong.empty()) return wrong;
  const std::string sentence = bench.faults.empty() ? "" : bench.faults.front().message;
  switch (row.outcome) {
    case reported:
      if (sentence.empty()) return "no fault within " + std::to_string(row.bound_s) + " s";
      if (sentence.find(row.says) == std::string::npos) return "another fault: " + sentence;
      return after_s <= row.bound_s ? "" : "late: " + std::to_string(after_s) + " s";
    case marked:
      if (!sentence.empty()) return "a fault: " + sentence;
      return is_marked(bench, row.says, from) ? "" : "nothing marks it";
    case right:
      if (!sentence.empty()) return "a fault: " + sentence;
      if (bench.is_stage() && bench.moves_done < 3) return "the work does not go on";
      return bench.samples.size() > from + 100 ? "" : "few samples";
    case safe:
    case elsewhere:
      return "";
  }
  return "?";
}

Found try_row(const Row& row) {
  FaultBench bench(row.device);
  double onset_s = 0;
  bool up = false;
  std::size_t from = 0;
  if (row.before_opening) {
    bench.inject(row.fault, row.more);
    up = bench.ready();
    onset_s = 0;
  } else {
    up = bench.ready();
    if (!up) return {0, "not ready before the fault: " + bench.faults.front().message};
    bench.work(1.3);
    if (!bench.faults.empty())
      return {0, "a fault before the fault: " + bench.faults.front().message};
    from = bench.samples.size();
    onset_s = bench.now_s();
    bench.inject(row.fault, row.more);
  }
  if (up) bench.work(row.bound_s + 0.5);
  const double after_s = bench.faults.empty() ? 0 : bench.fault_times_s.front() - onset_s;
  Found found{after_s, judged(bench, row, from, after_s)};
  bench.let_go(4);
  if (!bench.at_rest()) found.wrong += " a stage still moves";
  return found;
}

}  // namespace

TEST_CASE(
    "every fault is reported, marked, harmless or somebody else's, and ends with the stages at "
    "rest") {
  std::cout << "SIMULATED faults x drivers, virtual time. Bound and time from the onset to the "
               "fault in s.\n"
            << std::left << std::setw(13) << "device" << std::setw(20) << "fault" << std::setw(11)
            << "outcome" << std::setw(7) << "bound" << std::setw(8) << "after"
            << "says\n";
  for (const Row& row : rows) {
    const Found found = try_row(row);
    std::ostringstream line;
    line << std::left << std::setw(13) << row.device << std::setw(20) << row.fault << std::setw(11)
         << name_of(row.outcome) << std::setw(7) << row.bound_s << std::setw(8)
         << std::setprecision(3) << found.after_s << row.says
         << (found.wrong.empty() ? "" : "   WRONG: " + found.wrong);
    std::cout << line.str() << "\n";
    INFO(line.str() << " " << row.more);
    CHECK(found.wrong.empty());
  }
}

TEST_CASE("no fault that can befall a device is left out of the table") {
  using namespace sim::befalls;
  const std::map<std::string_view, int> exposures{
      {"lts", stage | stream},       {"prm", stage | stream},
      {"ft", force | datagram},      {"digital", digital | stream},
      {"taxels", taxels | stream},   {"cpm", taxels | datagram},
      {"vibro", vibration | stream}, {"vibro_udp", vibration | datagram}};
  for (const auto& [device, exposure] : exposures) {
    std::set<std::string_view> tried;
    for (const Row& row : rows)
      if (row.device == device) tried.insert(row.fault);
    for (const sim::FaultType& type : sim::fault_types()) {
      INFO(device << " " << type.name);
      CHECK(((type.whom & exposure) != 0) == tried.contains(type.name));
    }
  }
  CHECK(sim::fault_types().size() >= 30);
}

TEST_CASE("the same seed lets the same faults befall the same samples") {
  const auto lost = [] {
    FaultBench bench("ft");
    REQUIRE(bench.ready());
    bench.inject("drop", R"("probability": 0.2)");
    bench.work(3);
    std::vector<std::uint32_t> sequence;
    for (const Seen& seen : bench.samples) sequence.push_back(seen.sequence);
    return sequence;
  };
  CHECK(lost() == lost());
}
