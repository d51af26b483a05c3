// Checks of the computer: scheduling, clocks, disk; declared in doctor.hpp.

#include "daemon/campaign/diagnostics/doctor.hpp"

#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <fstream>

#include "daemon/base/loop/threads.hpp"
#include "daemon/base/version/software_version.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

// A day of the paper's campaign needs well below a gigabyte.
constexpr std::uintmax_t little_space = 1'000'000'000;
constexpr std::uintmax_t no_space = 100'000'000;
constexpr long coarse_clock_ns = 1000;
constexpr const char* limits_file = "/etc/security/limits.d/weft.conf";

std::optional<bool> wall_clock_synchronised() {
  timex query{};
  const int state = ::adjtimex(&query);
  if (state < 0) return std::nullopt;
  return state != TIME_ERROR && (query.status & STA_UNSYNC) == 0;
}

std::vector<std::string> frequency_governors() {
  std::vector<std::string> out;
  std::error_code error;
  for (const auto& processor : fs::directory_iterator("/sys/devices/system/cpu", error)) {
    std::ifstream in(processor.path() / "cpufreq/scaling_governor");
    if (std::string governor; in >> governor) out.push_back(governor);
  }
  return out;
}

std::string limits_hint(const char* item, const char* value) {
  return std::string("Add `* - ") + item + " " + value + "` to " + limits_file +
         " and log in again";
}

Diagnosis scheduling(const MachineFacts& facts) {
  if (facts.fifo_permitted) return {Severity::ok, "scheduling", "SCHED_FIFO is permitted", {}};
  return {Severity::warning, "scheduling",
          "SCHED_FIFO is not permitted, other programs can delay the control loop",
          limits_hint("rtprio", "50")};
}

Diagnosis memory(const MachineFacts& facts) {
  if (facts.memory_lockable) return {Severity::ok, "memory", "can be locked", {}};
  return {Severity::warning, "memory", "cannot be locked, swapped pages can delay the control loop",
          limits_hint("memlock", "unlimited")};
}

Diagnosis monotonic(const MachineFacts& facts) {
  const std::string what =
      "monotonic resolution " + std::to_string(facts.clock_resolution_ns) + " ns";
  if (facts.clock_resolution_ns <= coarse_clock_ns) return {Severity::ok, "clock", what, {}};
  return {Severity::warning, "clock", what + ", timers are equally coarse",
          "Use a kernel with high-resolution timers"};
}

Diagnosis wall_clock(const MachineFacts& facts) {
  if (!facts.clock_synchronised) return {Severity::ok, "wall clock", "synchronisation unknown", {}};
  if (*facts.clock_synchronised) return {Severity::ok, "wall clock", "synchronised", {}};
  return {Severity::warning, "wall clock",
          "not synchronised, dates in data sets may be wrong (durations are correct)",
          "Run `timedatectl set-ntp true`"};
}

Diagnosis governor(const MachineFacts& facts) {
  const auto slow =
      std::ranges::find_if(facts.governors, [](const auto& g) { return g != "performance"; });
  if (facts.governors.empty()) return {Severity::ok, "processor", "no frequency scaling found", {}};
  if (slow == facts.governors.end()) return {Severity::ok, "processor", "governor performance", {}};
  return {Severity::warning, "processor", "governor " + *slow + ", an idle processor wakes up late",
          "Run `cpupower frequency-set -g performance`"};
}

Diagnosis disk(const MachineFacts& facts) {
  if (!facts.free_bytes)
    return {Severity::problem, "disk", "data folder not found",
            "Create it, or choose another folder (--out)"};
  if (!facts.folder_writable)
    return {Severity::problem, "disk", "data folder not writable",
            "Choose another folder (--out), or ask its owner for access"};
  const std::string what = std::to_string(*facts.free_bytes / 1'000'000) + " MB free";
  if (*facts.free_bytes >= little_space) return {Severity::ok, "disk", what, {}};
  return {*facts.free_bytes < no_space ? Severity::problem : Severity::warning, "disk", what,
          "Free some space, or choose another folder (--out)"};
}

// Data sets, models and certificates name the commit.
Diagnosis software(const MachineFacts& facts) {
  const std::string what = "weft " + facts.software;
  if (!facts.software.ends_with(".modified")) return {Severity::ok, "software", what, {}};
  return {Severity::warning, "software",
          what + ", built from uncommitted changes, not reproducible",
          "Commit the changes, build Weft again and record with that version"};
}

}  // namespace

MachineFacts check_machine(const fs::path& data_folder) {
  MachineFacts facts;
  {
    const RealTimeScope scope;
    facts.fifo_permitted = scope.scheduled();
    facts.memory_lockable = scope.locked();
  }
  timespec resolution{};
  ::clock_getres(CLOCK_MONOTONIC, &resolution);
  facts.clock_resolution_ns = resolution.tv_sec * 1'000'000'000 + resolution.tv_nsec;
  facts.clock_synchronised = wall_clock_synchronised();
  facts.governors = frequency_governors();
  std::error_code error;
  const fs::space_info space = fs::space(data_folder, error);
  if (!error) facts.free_bytes = space.available;
  facts.software = software_version();
  facts.folder_writable = ::access(data_folder.c_str(), W_OK) == 0;
  return facts;
}

std::vector<Diagnosis> check_system(const MachineFacts& facts, bool real_time) {
  if (!real_time)
    return {{Severity::ok, "time", "virtual, independent of the speed of this computer", {}},
            disk(facts)};
  return {scheduling(facts), memory(facts), monotonic(facts), wall_clock(facts),
          governor(facts),   disk(facts),   software(facts)};
}

}  // namespace weft::daemon
