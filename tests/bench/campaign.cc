// Wall time of simulated trials through the codecs, and its parts.

#include <cstdio>
#include <filesystem>

#include "daemon/campaign/campaign.hpp"
#include "tests/bench/figures.hpp"

int main() {
  using namespace weft;
  const std::filesystem::path out = "out/bench/campaign";
  std::vector<double> wall;
  std::vector<daemon::CampaignSummary> runs;
  for (int run = 0; run < 3; ++run) {
    std::filesystem::remove_all(out);
    daemon::CampaignRequest request{"tests/bench/campaign_recipe.json", "sim/rigs/bench17.json",
                                    out, std::nullopt};
    const Result<daemon::CampaignSummary> summary = daemon::run_campaign(request, {});
    if (!summary || summary->trials_complete != summary->trials_planned) {
      std::fprintf(stderr, "campaign: %s\n",
                   summary ? "not complete" : to_string(summary.error()).c_str());
      return 1;
    }
    runs.push_back(*summary);
    wall.push_back(summary->wall_s);
  }
  const daemon::CampaignSummary& s = runs.back();
  const double middle = bench::median(wall);
  const double wall_680 = middle / static_cast<double>(s.trials_planned) * 680;
  const std::string share = "share of the wall time, sampled";
  return bench::report(
      "campaign",
      {{"simulated trials, wall time each", middle / static_cast<double>(s.trials_planned), "s",
        "virtual time each", s.virtual_s / static_cast<double>(s.trials_planned),
        "median of 3 runs of one fabric, M1 and M2 in equal numbers, recording included"},
       {"680 trials at that rate", wall_680, "s", "aim for the demo", 60, "simulated"},
       {"plant and emulators", s.time.plant_and_emulators_s, "s", "wall time of that run", s.wall_s,
        share},
       {"drivers, supervisor, engine", s.time.drivers_and_control_s, "s", "wall time of that run",
        s.wall_s, share},
       {"recorder", s.time.recorder_s, "s", "wall time of that run", s.wall_s, share},
       {"force error in phase M, RMS (simulated)", s.force.rms_n(), "N", "band of the recipe", 0.25,
        "all samples of all trials"}});
}
