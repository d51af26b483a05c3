// Injects every fault for every driver that can have it, and checks the driver's reaction. Prints
// the table.

#include <catch2/catch.hpp>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "sim/devices/faults/fault.hpp"
#include "tests/unit/daemon/hardware/fault_bench.hpp"
#include "tests/unit/daemon/hardware/fault_rows.hpp"

namespace fault_table_test {

using namespace weft;
using namespace weft::testing;

namespace {

/// No sample out of order, none in the future, no unmarked wild value. Each kind of sample has its
/// own sequence numbers.
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

/// State at the beginning of the fault.
struct Onset {
  double at_s = 0;
  std::size_t samples = 0, logs = 0;
};

/// Time at which a sample, or a line of the log, first marks the fault; earlier marks do not count.
std::optional<double> marked_at_s(const FaultBench& bench, std::string_view how,
                                  const Onset& onset) {
  for (std::size_t i = onset.samples; i < bench.samples.size(); ++i) {
    const Seen& seen = bench.samples[i];
    if ((how == "lost" && seen.lost > 0) || (how == "not valid" && !seen.valid))
      return to_seconds(seen.at);
  }
  for (std::size_t i = onset.logs; i < bench.logs.size(); ++i)
    if (bench.logs[i].find(how) != std::string::npos) return bench.log_times_s[i];
  return std::nullopt;
}

struct Found {
  double after_s = 0;  ///< from the onset to the fault, or to its first mark
  std::string wrong;   ///< empty: as the row requires
};

bool is_required(const Error& fault, const Row& row) {
  for (const Reaction& reaction : reactions)
    if (reaction.says == row.says)
      return fault.code == reaction.code && fault.what.find(reaction.word) != std::string::npos;
  return false;
}

std::string evaluated(const FaultBench& bench, const Row& row, const Onset& onset,
                      std::optional<double> after_s) {
  if (const std::string wrong = wrong_with(bench, row); !wrong.empty()) return wrong;
  const std::string sentence = bench.faults.empty() ? "" : to_string(bench.faults.front());
  const auto in_time = [&] {
    return *after_s <= row.bound_s ? "" : "late: " + std::to_string(*after_s) + " s";
  };
  switch (row.outcome) {
    case reported:
      if (sentence.empty()) return "no fault within " + std::to_string(row.bound_s) + " s";
      if (!is_required(bench.faults.front(), row)) return "another fault: " + sentence;
      return in_time();
    case marked:
      if (!sentence.empty()) return "a fault: " + sentence;
      return after_s ? in_time() : "nothing marks it";
    case right:
      if (!sentence.empty()) return "a fault: " + sentence;
      if (bench.is_stage() && bench.moves_done < 3) return "the work does not go on";
      return bench.samples.size() > onset.samples + 100 ? "" : "few samples";
    case safe:
    case elsewhere:
      return "";
  }
  return "?";
}

Found try_row(const Row& row) {
  FaultBench bench(row.device);
  Onset onset;
  bool up = false;
  if (row.before_opening) {
    bench.inject(row.fault, row.more);
    up = bench.ready();
  } else {
    up = bench.ready();
    if (!up) return {0, "not ready before the fault: " + bench.faults.front().what};
    bench.work(1.3);
    if (!bench.faults.empty()) return {0, "a fault before the fault: " + bench.faults.front().what};
    onset = {bench.now_s(), bench.samples.size(), bench.logs.size()};
    bench.inject(row.fault, row.more);
  }
  // A fault that is only marked has the same working time as a harmless one.
  if (up) bench.work((row.outcome == marked ? 10 : row.bound_s) + 0.5);
  std::optional<double> at_s;
  if (!bench.faults.empty())
    at_s = bench.fault_times_s.front();
  else if (row.outcome == marked)
    at_s = marked_at_s(bench, row.says, onset);
  if (at_s) at_s = *at_s - onset.at_s;
  Found found{at_s.value_or(0), evaluated(bench, row, onset, at_s)};
  bench.let_go(4);
  if (!bench.at_rest()) found.wrong += " a stage still moves";
  return found;
}

}  // namespace

TEST_CASE(
    "every fault is reported, marked, harmless or left to another part, and the stages come to "
    "rest") {
  std::cout << "SIMULATED faults x drivers, virtual time. Bound and time from the onset to the "
               "fault, or to the first mark of it, in s.\n"
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

TEST_CASE("no fault that a device can have is left out of the table") {
  using namespace sim::exposed;
  const std::map<std::string_view, int> exposures{
      {"lts", stage | stream},       {"prm", stage | stream},
      {"ft", force | datagram},      {"digital", digital | stream},
      {"taxels", taxels | stream},   {"cpm", taxels | datagram},
      {"vibro", vibration | stream}, {"vibro_udp", vibration | datagram},
      {"imprint", imprint | stream}};
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

TEST_CASE("the next bias removes the force offset of a drift or a jump") {
  for (const char* device : {"ft", "digital"}) {
    // The drift of 2 N/s since then, in the middle of the readings.
    for (const auto& [fault, since_n] : {std::pair{"drift", 0.7}, {"bias_jump", 0.0}}) {
      INFO(device << " " << fault);
      FaultBench bench(device);
      REQUIRE(bench.ready());
      const auto mean_n = [&bench] {
        const std::size_t from = bench.samples.size();
        bench.work(0.5);
        double sum = 0;
        for (std::size_t i = from; i < bench.samples.size(); ++i) sum += bench.samples[i].value;
        return sum / static_cast<double>(bench.samples.size() - from);
      };
      const double before_n = mean_n();
      bench.inject(fault, R"("amount": 2)");
      bench.work(0.5);
      REQUIRE(mean_n() - before_n > 1);
      REQUIRE(bench.driver().command(BiasCommand{}));
      bench.work(0.1);
      CHECK(mean_n() == Approx(since_n).margin(0.1));
      CHECK(bench.faults.empty());
    }
  }
}

TEST_CASE("the same seed gives the same samples the same faults") {
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

}  // namespace fault_table_test
