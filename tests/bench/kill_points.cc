// Kills a campaign at seeded moments, resumes it, and compares it trial by trial with an
// undisturbed one. SIMULATED. WEFT_BENCH_KILLS kills (1000): half at writes to the file, half at
// moments of the wall clock, in a campaign of WEFT_BENCH_TRIALS (40) trials. A moment after the end
// kills nothing; it is inspected too, and another moment is drawn.

#include <time.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <thread>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/recorder/log_check.hpp"
#include "tests/bench/figures.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"

using namespace weft;
using namespace weft::daemon;
namespace fs = std::filesystem;

namespace {

std::size_t number_from(const char* variable, std::size_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

std::string recipe_of(std::size_t trials) {
  return R"({"schema_version":1,"name":"kills","source":"bench","seed":11,"fabrics":["denim","satin"],
    "repetitions":)" +
         std::to_string(trials / 2) +
         R"(,"explorations":{"M1":{"phases":[{"phase":"S","duration_s":1},
    {"phase":"P","force_N":5,"force_band_N":0.25,"duration_s":1},
    {"phase":"M","force_N":5,"force_band_N":0.25,"speed_mm_s":2,"path":[{"dx_mm":0,"dy_mm":8}]},
    {"phase":"E","duration_s":1}]}}})";
}

CampaignRequest request_in(const fs::path& folder, const fs::path& out, std::size_t trials) {
  std::ofstream(folder / "recipe.json") << recipe_of(trials);
  CampaignRequest request{folder / "recipe.json", "sim/rigs/bench17.json", out, {}};
  request.error_check = false;
  return request;
}

/// Kills the campaign from outside after `delay`. True if it was still running.
bool killed_after(const CampaignRequest& request, std::chrono::microseconds delay,
                  const CampaignHooks& hooks) {
  const pid_t child = fork();
  if (child == 0) _exit(run_campaign(request, hooks) ? 0 : 1);
  std::this_thread::sleep_for(delay);
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFSIGNALED(status);
}

struct Counts {
  std::size_t moments = 0, kills = 0, failures = 0, repeated = 0, lost = 0, doubled = 0;
};

bool fails(Counts& counts, const std::string& what) {
  ++counts.failures;
  std::printf("kill %zu: %s\n", counts.kills, what.c_str());
  return false;
}

/// Resumes a killed campaign and checks it. `reported`: trials that the killed run reported as
/// complete.
bool inspect(CampaignRequest request, const Dataset& undisturbed, std::size_t reported,
             Counts& counts) {
  const fs::path file = request.out / campaign_file_name;
  std::size_t saved = 0;
  if (fs::exists(file) && !is_blank_campaign(file)) {
    const auto seen = verify(file);
    if (!seen || !seen->holds()) return fails(counts, "does not hold after the kill");
    saved = seen->complete;
  }
  counts.lost += reported > saved ? reported - saved : 0;
  request.resume = true;
  if (!fs::exists(request.out / "certificate.json")) {
    const auto summary = run_campaign(request, {});
    if (!summary) return fails(counts, to_string(summary.error()));
  }
  const auto after = verify(request.out);
  if (!after || !after->holds() || !after->certified) return fails(counts, "does not hold");
  const auto all = load_campaign(file, {});
  if (!all) return fails(counts, to_string(all.error()));
  counts.repeated += after->attempts - after->complete;
  if (after->attempts > after->complete + 1) return fails(counts, "more than one repeated");
  counts.doubled += after->complete > undisturbed.trials.size() ? 1 : 0;
  const std::string differs = test::difference(undisturbed, *all);
  return differs.empty() || fails(counts, "differs: " + differs);
}

}  // namespace

int main() {
  const std::size_t kills = number_from("WEFT_BENCH_KILLS", 1000);
  const std::size_t trials = number_from("WEFT_BENCH_TRIALS", 40);
  const fs::path folder = fs::temp_directory_path() / ("weft-kills-" + std::to_string(getpid()));
  fs::create_directories(folder);
  const auto began = steady_wall_now();
  const auto whole = run_campaign(request_in(folder, folder / "whole", trials), {});
  if (!whole) return std::printf("%s\n", to_string(whole.error()).c_str()), 1;
  const auto lasting =
      std::chrono::duration_cast<std::chrono::microseconds>(steady_wall_now() - began);
  const auto undisturbed = load_campaign(whole->campaign_file, {});
  std::mt19937_64 dice(2026);
  Counts counts;
  while (counts.kills < kills && counts.moments < 3 * kills) {
    const fs::path out = folder / "out";
    fs::remove_all(out);
    const CampaignRequest request = request_in(folder, out, trials);
    const bool by_write = ++counts.moments % 2 == 0;
    const test::ReportedTrials reported;
    const std::optional<bool> killed =
        by_write ? test::killed_at(request, {1 + dice() % (40 * trials), dice() % 2 == 0},
                                   reported.hooks())
                 : killed_after(request, lasting * (dice() % 1000) / 1000, reported.hooks());
    if (!killed) fails(counts, "it neither died nor came to its end");
    counts.kills += killed == true ? 1 : 0;
    inspect(request, *undisturbed, reported.complete(), counts);
  }
  fs::remove_all(folder);
  const double seconds = std::chrono::duration<double>(steady_wall_now() - began).count();
  bench::report("kill_points",
                {{"killed", static_cast<double>(counts.kills), "", "asked",
                  static_cast<double>(kills), "at seeded moments, simulated"},
                 {"moments drawn", static_cast<double>(counts.moments), "", "", 0,
                  "the others came too late"},
                 {"repetitions repeated", static_cast<double>(counts.repeated), "",
                  "at most one each", static_cast<double>(counts.kills), ""},
                 {"complete ones lost", static_cast<double>(counts.lost), "", "none", 0, ""},
                 {"complete ones doubled", static_cast<double>(counts.doubled), "", "none", 0, ""},
                 {"failures", static_cast<double>(counts.failures), "", "none", 0, ""},
                 {"wall time", seconds, "s", "", 0, ""}});
  return counts.kills < kills || counts.failures + counts.lost + counts.doubled > 0 ? 1 : 0;
}
