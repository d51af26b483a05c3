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
#include "tests/unit/faults/fault_rows.hpp"

using namespace weft;
using namespace weft::testing;

namespace {

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
