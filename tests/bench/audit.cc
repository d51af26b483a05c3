// Verdicts of the audit on made-up campaigns (SIMULATED numbers) with known truth: a hundred with a
// planted confound, a hundred clean ones, a hundred with shuffled labels.

#include <array>
#include <cstdio>

#include "tests/bench/figures.hpp"
#include "tests/unit/classifier/audit_data.hpp"

namespace {

using namespace weft::classifier;
using testing::made_up_campaign;
using testing::MadeUpCampaign;
using weft::bench::at_least;
using weft::bench::at_most;
using weft::bench::Figure;

constexpr std::size_t seeds = 100;

AuditFigures audit_of(const MadeUpCampaign& campaign, std::uint64_t seed) {
  AuditOptions options;
  options.seed = seed;
  return audit(campaign.full, campaign.probes, split_in_parts(campaign.full, true, 3), options)
      .value();
}

struct Counts {
  double found = 0, others = 0, clean_accused = 0, shuffled_named = 0;
};

void count_planted(std::uint64_t seed, double effect, Counts& counts) {
  constexpr std::array probes = {"pad pattern", "durations", "order and time", "phase S"};
  const char* const planted = probes[seed % probes.size()];
  for (const ProbeFigure& one : audit_of(made_up_campaign(seed, {planted, effect}), seed).probes)
    if (one.named) ++(one.name == planted ? counts.found : counts.others);
}

void count_shuffled(std::uint64_t seed, Counts& counts) {
  MadeUpCampaign campaign = made_up_campaign(seed, {"pad pattern"});
  const auto splits = split_in_parts(campaign.full, true, 3);
  RandomEngine engine(seed);
  campaign.full.labels =
      permute_labels(make_permutation_units(campaign.full, splits).value(), engine);
  for (Probe& probe : campaign.probes) probe.features.labels = campaign.full.labels;
  for (const ProbeFigure& one : audit_of(campaign, seed).probes)
    counts.shuffled_named += one.named ? 1 : 0;
}

}  // namespace

int main() {
  Counts strong, weak;
  const double seconds = weft::bench::seconds_of([&] {
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      count_planted(seed, 2.0, strong);
      count_planted(1000 + seed, 1.0, weak);
      strong.clean_accused +=
          audit_of(made_up_campaign(2000 + seed, {}), seed).verdict == AuditVerdict::confounded ? 1
                                                                                                : 0;
      count_shuffled(3000 + seed, strong);
    }
  });
  const std::string each = "48 trials, 4 labels, 6 groups, SIMULATED";
  return weft::bench::report(
      "audit",
      {{"planted at 2 sd, found", strong.found, "of 100", "", 0, each, at_least(95)},
       {"planted at 2 sd, others named", strong.others, "of 300", "", 0, each},
       {"planted at 1 sd, found", weak.found, "of 100", "", 0, each},
       {"clean, accused", strong.clean_accused, "of 100", "", 0, each, at_most(5)},
       {"shuffled labels, probes named", strong.shuffled_named, "of 400", "", 0, each, at_most(2)},
       {"an audit", seconds / (4 * seeds), "s", "", 0, each}});
}
