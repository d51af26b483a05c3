// Overhead of a trial without samples and devices: every step of the engine and all records of the
// trial, in the program's own order, for a campaign of 680 trials. Devices answer at once, and no
// sample comes. SIMULATED.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "daemon/campaign/trial_recording.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "tests/bench/figures.hpp"
#include "tests/unit/recipes/engine_bench.hpp"

namespace {

using namespace weft;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int runs = 5;
constexpr double aim_ms = 1.0;

// 17 fabrics, M1 and M2, twenty repetitions.
std::string recipe() {
  std::string fabrics, slides;
  for (int i = 0; i < 17; ++i)
    fabrics += (i > 0 ? R"(,"fabric-)" : R"("fabric-)") + std::to_string(i) + '"';
  for (const std::string path :
       {R"({"dx_mm":0,"dy_mm":50})", R"({"dx_mm":0,"dy_mm":25},{"dx_mm":25,"dy_mm":0})"})
    slides += std::string(slides.empty() ? R"("M1")" : R"(,"M2")") + R"(:{"phases":[
      {"phase":"S","duration_s":3},{"phase":"P","force_N":5,"duration_s":6},
      {"phase":"M","speed_mm_s":2,"path":[)" +
              path + R"(]},{"phase":"E","duration_s":2}]})";
  return R"({"schema_version":1,"name":"all","fabrics":[)" + fabrics +
         R"(],"repetitions":20,"explorations":{)" + slides + "}}";
}

void must(const Status& done) {
  if (done) return;
  std::fprintf(stderr, "%s\n", to_string(done.error()).c_str());
  std::exit(1);
}

void record(const recipes::Effect& effect, daemon::TrialRecording& recording, TimePoint now) {
  if (const auto* begun = std::get_if<recipes::TrialBegin>(&effect)) {
    recording.begin(begun->trial, now);
  } else if (const auto* phase = std::get_if<recipes::SetPhase>(&effect)) {
    recording.set_phase(phase->phase, now);
  } else if (const auto* done = std::get_if<recipes::TrialDone>(&effect)) {
    recording.end(done->outcome, done->ended_early, now);
  }
}

/// Seconds of each trial, from its start to the start of the next.
std::vector<double> seconds_of_trials(const recipes::Plan& plan, const fs::path& file) {
  daemon::CampaignHeader header;
  header.trials_planned = static_cast<std::uint32_t>(plan.trials.size());
  header.info.kind = daemon::BenchKind::simulated;
  header.info.recipe_json = header.info.rig_json = "{}";
  auto recorder = daemon::Recorder::create(file, header);
  if (!recorder) must(tl::unexpected(recorder.error()));
  daemon::TrialRecording recording(*recorder, plan);
  recipes::test::Bench bench(plan);
  std::vector<double> seconds;
  auto before = Clock::now();
  while (bench.state.step != recipes::Step::done) {
    bench.now += std::chrono::seconds(1);
    const std::size_t done = bench.trials.size();
    for (const recipes::Effect& effect : bench.advance()) record(effect, recording, bench.now);
    if (bench.trials.size() == done) continue;
    const auto now = Clock::now();
    seconds.push_back(std::chrono::duration<double>(now - before).count());
    before = now;
  }
  if (recording.error()) must(tl::unexpected(*recording.error()));
  must(recorder->finish());
  return seconds;
}

}  // namespace

int main() {
  char name[] = "/tmp/weft-bench-XXXXXX";
  if (::mkdtemp(name) == nullptr) return std::perror(name), 1;
  const fs::path folder = name;
  const recipes::Plan plan = recipes::test::plan_of(recipe());
  std::vector<double> all;
  for (int run = 0; run < runs; ++run) {
    const auto own = seconds_of_trials(plan, folder / ("run" + std::to_string(run)));
    all.insert(all.end(), own.begin(), own.end());
  }
  fs::remove_all(folder);
  std::sort(all.begin(), all.end());
  const std::string note = std::to_string(all.size()) + " trials, simulated, no samples";
  return bench::report("orchestration",
                       {{"a trial beside its samples, median", 1e3 * bench::median(all), "ms",
                         "aim", aim_ms, note, bench::at_most(aim_ms)},
                        {"a trial beside its samples, p99", 1e3 * all[all.size() * 99 / 100], "ms",
                         "aim", aim_ms, note}});
}
