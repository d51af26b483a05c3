#include "daemon/analysis/design/sweep_analysis.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "classifier/base/parallel.hpp"
#include "classifier/design/resample.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::daemon {
namespace {

namespace design = classifier::design;

constexpr double lowest_count = 0, highest_count = 65535;  // ends of the array's range
constexpr std::size_t interval_resamples = 1000;

CellValue mean_of_trials(const std::vector<double>& values, std::uint64_t seed) {
  return {classifier::compute_mean(values),
          design::mean_interval(values, interval_resamples, seed)};
}

/// What is worked out of one cell by itself.
struct CellOutcome {
  SweepCell cell;
  design::WeighedCell weighed;
  std::string failed;
};

Status measure(const CellTrials& trials, double rate_hz, const SweepOptions& options,
               CellOutcome& out) {
  if (trials.trials.empty())
    return fail({.code = Errc::invalid_argument, .what = "it has no complete trial"});
  if (!(trials.speed_mps > 0))
    return fail({.code = Errc::invalid_argument,
                 .what = "its exploration does not slide: there is no phase M"});
  std::vector<double> snr, saturated;
  for (const classifier::Trial& trial : trials.trials) {
    const auto response = design::response_of(trial, rate_hz, trials.speed_mps, lowest_count,
                                              highest_count, options.band);
    if (!response) return pass(response.error());
    snr.push_back(response->snr_db);
    saturated.push_back(response->saturated_share);
  }
  out.cell.trials = trials.trials.size();
  out.cell.snr_db = mean_of_trials(snr, options.seed);
  out.cell.saturated_share = mean_of_trials(saturated, options.seed);
  out.cell.seconds = {design::quantile(trials.seconds, 0.5),
                      design::median_interval(trials.seconds, interval_resamples, options.seed)};
  const auto features = classifier::build_feature_matrix(trials.trials, {}, 1);
  if (!features) return pass(features.error());
  const auto separability_now = design::separability(*features, options.learner, options.seed);
  if (!separability_now) return pass(separability_now.error());
  std::map<std::string, std::size_t> replicates;
  std::map<std::string, std::vector<design::CellTrial>> fabrics;
  for (std::size_t i = 0; i < trials.trials.size(); ++i) {
    const classifier::Trial& trial = trials.trials[i];
    const std::size_t replicate = replicates.emplace(trial.group, replicates.size()).first->second;
    fabrics[trial.label].push_back({replicate, (*separability_now)[i], trials.seconds[i], snr[i]});
  }
  for (auto& [fabric, list] : fabrics) out.weighed.fabrics.push_back(std::move(list));
  return {};
}

std::vector<FactorShare> surest_values(const SweepAnalysis& analysis) {
  std::vector<FactorShare> out;
  for (std::size_t f = 0; f < analysis.factors.size(); ++f) {
    std::map<double, double> shares;
    for (std::size_t i = 0; i < analysis.cells.size(); ++i)
      shares[analysis.cells[i].factors[f]] += analysis.choice.cells[i].chosen_share;
    const auto most = std::ranges::max_element(
        shares, [](const auto& a, const auto& b) { return a.second < b.second; });
    if (shares.size() > 1) out.push_back({f, most->first, most->second});
  }
  return out;
}

/// The cells that can be compared; the others are told of in `left_out`.
std::vector<std::size_t> comparable(const std::vector<CellTrials>& cells,
                                    const std::vector<CellOutcome>& outcomes,
                                    std::vector<LeftOutCell>& left_out) {
  std::map<std::size_t, std::string> why;
  std::vector<std::size_t> measured;
  std::vector<const CellTrials*> trials;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!outcomes[i].failed.empty()) {
      why[i] = outcomes[i].failed;
      continue;
    }
    measured.push_back(i);
    trials.push_back(&cells[i]);
  }
  for (const auto& [k, words] : not_alike(trials)) why[measured[k]] = words;
  for (const auto& [i, words] : why) left_out.push_back({cells[i].factors, words});
  std::erase_if(measured, [&](std::size_t i) { return why.contains(i); });
  return measured;
}

Result<SweepAnalysis> analyse(const std::string& exploration, const std::vector<CellTrials>& cells,
                              const DatasetInfo& info, const SweepOptions& options) {
  if (options.progress)
    options.progress(exploration + ": " + std::to_string(cells.size()) + " cells");
  std::vector<CellOutcome> outcomes(cells.size());
  classifier::parallel_for(cells.size(), options.threads, [&](std::size_t i) {
    outcomes[i].cell.factors = cells[i].factors;
    if (Status ok = measure(cells[i], info.taxel_rate_hz, options, outcomes[i]); !ok)
      outcomes[i].failed = to_string(ok.error());
  });
  SweepAnalysis out;
  std::vector<design::WeighedCell> weighed;
  const std::vector<std::size_t> comparable_cells = comparable(cells, outcomes, out.left_out);
  if (comparable_cells.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = exploration,
                 .what = "no cell can be analysed; of the first: " + out.left_out.front().why});
  std::set<std::string> fabrics, replicates;  // alike in all cells
  for (const classifier::Trial& trial : cells[comparable_cells.front()].trials) {
    fabrics.insert(trial.label);
    replicates.insert(trial.group);
  }
  for (const std::size_t i : comparable_cells) {
    out.cells.push_back(std::move(outcomes[i].cell));
    weighed.push_back(std::move(outcomes[i].weighed));
  }
  out.replicates = replicates.size();
  out.bench = info.kind;
  out.exploration = exploration;
  out.factors = info.factors;
  out.fabrics = {fabrics.begin(), fabrics.end()};
  out.learner = classifier::to_string(options.learner);
  out.band = options.band;
  out.choice = design::choose_cell(weighed, options.resamples, options.seed);
  out.surest = surest_values(out);
  return out;
}

Result<std::vector<std::string>> collect_digests(std::span<const Dataset> datasets) {
  std::vector<std::string> out;
  for (const Dataset& dataset : datasets) {
    std::string digest = dataset_sha256(dataset);
    if (std::ranges::find(out, digest) != out.end())
      return fail({.code = Errc::invalid_argument,
                   .where = dataset.info.name,
                   .what = "the same data set twice",
                   .expected = "each once",
                   .got = digest,
                   .hint = "Its trials would be told by their own copies"});
    out.push_back(std::move(digest));
  }
  return out;
}

}  // namespace

Result<std::vector<SweepAnalysis>> analyse_sweep(std::span<const Dataset> datasets,
                                                 const SweepOptions& options) {
  const auto cells = swept_cells(datasets);
  if (!cells) return pass(cells.error());
  const auto digests = collect_digests(datasets);
  if (!digests) return pass(digests.error());
  std::vector<SweepAnalysis> out;
  std::vector<std::string> without;
  std::optional<Error> first;
  for (const auto& [exploration, of_it] : *cells) {
    auto one = analyse(exploration, of_it, datasets.front().info, options);
    if (one) {
      one->datasets = *digests;
      out.push_back(std::move(*one));
    } else {
      without.push_back(to_string(one.error()));
      if (!first) first = one.error();
    }
  }
  if (out.empty()) return pass(*first);
  for (SweepAnalysis& one : out) one.without = without;
  return out;
}

}  // namespace weft::daemon
