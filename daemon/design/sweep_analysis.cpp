#include "daemon/design/sweep_analysis.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "classifier/design/resample.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learn/parallel.hpp"
#include "daemon/report/format.hpp"
#include "daemon/trade/pareto.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {
namespace {

namespace design = classifier::design;

constexpr double lowest_count = 0, highest_count = 65535;  // ends of the array's range
constexpr double ns_per_s = 1e9;
constexpr std::size_t mean_resamples = 1000;

/// The trials of one cell, with where they come from.
struct CellTrials {
  std::vector<classifier::Trial> trials;
  std::vector<double> seconds;
  double speed_mps = 0;
};
/// By the values of the factors.
using Cells = std::map<std::vector<double>, CellTrials>;

Status check_together(std::span<const Dataset> datasets) {
  const DatasetInfo& first = datasets.front().info;
  for (const Dataset& dataset : datasets) {
    const DatasetInfo& info = dataset.info;
    if (info.factors.empty())
      return fail(Errc::invalid_argument, "the data set is of no sweep", info.name,
                  "a recipe with \"sweep\"", {}, "recipes/README.md says how to sweep");
    if (info.kind != first.kind)
      return fail(Errc::invalid_argument, "simulated and real data are never mixed", info.name,
                  std::string(to_string(first.kind)), std::string(to_string(info.kind)),
                  "Analyse them one by one");
    if (info.factors != first.factors)
      return fail(Errc::invalid_argument, "sweeps of different factors", info.name,
                  joined(first.factors), joined(info.factors));
  }
  return {};
}

Result<recipes::Plan> plan_of(const DatasetInfo& info) {
  const auto limits = recipes::parse_rig_limits(info.rig_json);
  if (!limits) return pass(limits.error(), info.name + ": rig on record");
  recipes::CheckReport report = recipes::check_recipe(info.recipe_json, *limits);
  if (!report.plan)
    return fail(Errc::invalid_argument, recipes::to_string(report.problems.front()),
                info.name + ": recipe on record");
  if (!report.plan->sweep)
    return fail(Errc::corrupt, "factors without a sweep in the recipe on record", info.name);
  return *std::move(report.plan);
}

/// The recipe's name of an exploration, which its cells' names begin with.
const std::string* base_of(const recipes::Plan& plan, std::size_t exploration) {
  const auto& names = plan.sweep->explorations;
  const std::size_t cells = plan.sweep->cells.size();
  return exploration / cells < names.size() ? &names[exploration / cells] : nullptr;
}

double recorded_s(const TrialRecord& record) {
  if (record.t_ns.size() < 2) return 0;
  return static_cast<double>(record.t_ns.back() - record.t_ns.front()) / ns_per_s;
}

/// Adds the complete trials of a data set to the cells of their explorations.
Status add(const Dataset& dataset, std::size_t number, std::map<std::string, Cells>& all) {
  const auto plan = plan_of(dataset.info);
  if (!plan) return pass(plan.error());
  std::map<std::string, std::size_t> explorations;
  for (std::size_t e = 0; e < plan->explorations.size(); ++e)
    explorations[plan->explorations[e].name] = e;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const TrialRecord& record = dataset.records[i];
    if (record.outcome != TrialOutcome::complete) continue;
    const auto found = explorations.find(record.spec.exploration);
    const std::string* base = found == explorations.end() ? nullptr : base_of(*plan, found->second);
    if (base == nullptr)
      return fail(Errc::corrupt, "a trial of an exploration that the recipe on record lacks",
                  dataset.trials[i].file, {}, record.spec.exploration);
    CellTrials& cell = all[*base][record.spec.factors];
    const recipes::Exploration& exploration = plan->explorations[found->second];
    cell.speed_mps = exploration.slides() ? exploration.step(Phase::motion).speed_mps : 0;
    cell.trials.push_back(dataset.trials[i]);
    // the same repetition of two campaigns is not the same replicate
    cell.trials.back().group = std::to_string(number) + "/" + cell.trials.back().group;
    cell.trials.back().file = std::to_string(number) + "/" + cell.trials.back().file;
    cell.seconds.push_back(recorded_s(record));
  }
  return {};
}

CellMean mean_of_trials(const std::vector<double>& values, std::uint64_t seed) {
  return {classifier::mean_of(values), design::mean_interval(values, mean_resamples, seed)};
}

/// What is worked out of one cell by itself.
struct CellOutcome {
  SweepCell cell;
  design::WeighedCell weighed;
  std::optional<Error> failed;
};

Status measure(const CellTrials& trials, double rate_hz, const SweepOptions& options,
               CellOutcome& out) {
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
  out.cell.seconds = mean_of_trials(trials.seconds, options.seed);
  const auto features = classifier::build_feature_matrix(trials.trials, {}, 1);
  if (!features) return pass(features.error());
  auto answers = design::separability(*features, options.learner, options.seed);
  if (!answers) return pass(answers.error());
  out.weighed = {std::move(*answers), out.cell.seconds.mean, out.cell.snr_db.mean};
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

Result<SweepAnalysis> analyse(const std::string& exploration, const Cells& cells,
                              const DatasetInfo& info, const SweepOptions& options) {
  if (options.progress)
    options.progress(exploration + ": " + std::to_string(cells.size()) + " cells");
  std::vector<const CellTrials*> trials;
  std::vector<CellOutcome> outcomes(cells.size());
  for (const auto& [factors, cell] : cells) {
    outcomes[trials.size()].cell.factors = factors;
    trials.push_back(&cell);
  }
  classifier::parallel_for(cells.size(), options.threads, [&](std::size_t i) {
    if (Status ok = measure(*trials[i], info.taxel_rate_hz, options, outcomes[i]); !ok)
      outcomes[i].failed = ok.error();
  });
  SweepAnalysis out;
  std::set<std::string> fabrics;
  std::vector<design::WeighedCell> weighed;
  std::vector<Bargain> bargains;
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    if (outcomes[i].failed) return pass(*outcomes[i].failed, exploration);
    std::set<std::string> replicates;
    for (const classifier::Trial& trial : trials[i]->trials) {
      fabrics.insert(trial.label);
      replicates.insert(trial.group);
    }
    out.replicates = i == 0 ? replicates.size() : std::min(out.replicates, replicates.size());
    bargains.push_back({outcomes[i].weighed.answers.accuracy(), outcomes[i].weighed.seconds});
    out.cells.push_back(std::move(outcomes[i].cell));
    weighed.push_back(std::move(outcomes[i].weighed));
  }
  auto front = pareto_front(bargains);
  if (!front) return pass(front.error(), exploration);
  out.front = std::move(*front);
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

}  // namespace

Result<std::vector<SweepAnalysis>> analyse_sweep(std::span<const Dataset> datasets,
                                                 const SweepOptions& options) {
  if (datasets.empty()) return fail(Errc::invalid_argument, "no data set", "design analyse");
  if (Status ok = check_together(datasets); !ok) return pass(ok.error());
  std::map<std::string, Cells> cells;
  std::vector<std::string> digests;
  for (std::size_t i = 0; i < datasets.size(); ++i) {
    if (Status ok = add(datasets[i], i, cells); !ok) return pass(ok.error());
    std::string digest = dataset_sha256(datasets[i]);
    if (std::ranges::find(digests, digest) != digests.end())
      return fail(Errc::invalid_argument, "the same data set twice", datasets[i].info.name,
                  "each once", digest, "Its trials would be told by their own copies");
    digests.push_back(std::move(digest));
  }
  std::vector<SweepAnalysis> out;
  for (const auto& [exploration, of_it] : cells) {
    auto one = analyse(exploration, of_it, datasets.front().info, options);
    if (!one) return pass(one.error());
    one->datasets = digests;
    out.push_back(std::move(*one));
  }
  if (out.empty()) return fail(Errc::invalid_argument, "no complete trial", "design analyse");
  return out;
}

}  // namespace weft::daemon
