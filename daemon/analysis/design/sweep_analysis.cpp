#include "daemon/analysis/design/sweep_analysis.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <set>

#include "classifier/base/parallel.hpp"
#include "classifier/design/resample.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

namespace design = classifier::design;

constexpr double lowest_count = 0, highest_count = 65535;  // limits of the array's range [count]
constexpr std::size_t interval_resamples = 1000;

CellValue mean_of_trials(const std::vector<double>& values, std::uint64_t seed) {
  return {classifier::compute_mean(values),
          design::mean_interval(values, interval_resamples, seed)};
}

/// Results of one cell by itself.
struct CellOutcome {
  SweepCell cell;
  design::WeighedCell weighed;
  std::string failed;
};

Status measure(const CellTrials& trials, double rate_hz, const SweepOptions& options,
               CellOutcome& out) {
  if (trials.trials.empty())
    return fail({.code = Errc::invalid_argument, .what = "no complete trials"});
  if (!(trials.speed_mps > 0))
    return fail({.code = Errc::invalid_argument, .what = "exploration without phase M"});
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

/// The comparable cells; the others are added to `left_out`.
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
                 .what = "no usable cell; first cell: " + out.left_out.front().why});
  std::set<std::string> fabrics, replicates;  // equal in all cells
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
                   .what = "data set given twice",
                   .expected = "each data set once",
                   .got = digest,
                   .hint = "Remove the copy: training and test would share its trials"});
    out.push_back(std::move(digest));
  }
  return out;
}

constexpr std::size_t max_listed = 20;

struct Shown {
  std::string_view name, title, unit;
  double per_si;
};
constexpr std::array shown{
    Shown{"force_n", "force [N]", " N", 1}, Shown{"speed_mps", "speed [mm/s]", " mm/s", 1e3},
    Shown{"press_s", "press [s]", " s", 1}, Shown{"stroke_m", "stroke [mm]", " mm", 1e3},
    Shown{"direction_rad", "direction [deg]", " deg", 180 / std::numbers::pi}};

/// A factor of a later version is shown by its name, without a unit.
Shown shown_as(std::string_view factor) {
  for (const Shown& one : shown)
    if (one.name == factor) return one;
  return {factor, factor, "", 1};
}

std::string format_value(std::string_view factor, double si) {
  return general(factor_shown(factor, si)) + std::string(shown_as(factor).unit);
}

std::string format_interval(const classifier::Interval& interval) {
  return percent(interval.low) + " to " + percent(interval.high) + " %";
}

std::string format_stability(const SweepAnalysis& a) {
  std::string out = "In " + percent(a.choice.share, 0) + " % of " + thousands(a.choice.resamples) +
                    " resampled pilots of the same size the same cell is chosen";
  std::vector<std::string> values;
  for (const FactorShare& one : a.surest)
    values.push_back(format_value(a.factors[one.factor], one.value) + " in " +
                     percent(one.share, 0) + " %");
  if (!values.empty()) out += ", " + joined(values, " and ");
  return out + ".";
}

std::string format_seconds(const SweepAnalysis& a, std::size_t cell) {
  return fixed(a.cells[cell].seconds.value, 1) + " s";
}

/// Reason for the chosen cell: separability, then time, then signal-to-noise ratio.
std::string format_rule(const SweepAnalysis& a) {
  const auto& c = a.choice;
  const std::string best = c.chosen == c.most_separable
                               ? "No other cell has a higher accuracy. "
                               : "The best cell, " + format_cell(a, c.most_separable) +
                                     ", reaches " +
                                     percent(c.cells[c.most_separable].figures.accuracy) +
                                     " % in " + format_seconds(a, c.most_separable) + ". ";
  const std::string time =
      c.chosen == c.quickest
          ? "No cell within one standard error (" + percent(c.within) + " points) is quicker"
          : "The quickest cell within one standard error (" + percent(c.within) + " points), " +
                format_cell(a, c.quickest) + ", takes an equal time of " +
                format_seconds(a, c.quickest);
  const std::string signal =
      c.equal_time > 1 ? ". Among the " + std::to_string(c.equal_time) +
                             " cells of equal time this one has the largest signal over noise, " +
                             fixed(a.cells[c.chosen].snr_db.value, 1) + " dB"
                       : "";
  return best + time + signal + ".";
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

std::string factor_title(std::string_view factor) {
  return std::string(shown_as(factor).title);
}

double factor_shown(std::string_view factor, double si) {
  return si * shown_as(factor).per_si;
}

std::string format_cell(const SweepAnalysis& analysis, std::size_t cell) {
  return format_cell(analysis, analysis.cells[cell].factors);
}

std::string format_cell(const SweepAnalysis& analysis, const std::vector<double>& factors) {
  std::vector<std::string> out;
  for (std::size_t f = 0; f < analysis.factors.size(); ++f)
    out.push_back(format_value(analysis.factors[f], factors[f]));
  return joined(out);
}

std::string recommendation(const SweepAnalysis& a) {
  const std::size_t i = a.choice.chosen;
  const auto& chosen = a.choice.cells[i];
  const std::string found = format_cell(a, i) + ": " + percent(chosen.figures.accuracy) +
                            " % accuracy (95 %: " + format_interval(chosen.ci95) + "), " +
                            format_seconds(a, i) + " per trial";
  const std::string others = std::to_string(a.choice.overlapping) + " of the " +
                             std::to_string(a.cells.size() - 1) +
                             " other cells have an overlapping interval, " +
                             std::to_string(a.choice.quicker_overlapping) + " of them quicker.";
  if (a.choice.supported)
    return "Recommended setting: " + found + ". " + format_rule(a) + " " + format_stability(a) +
           " " + others;
  return "The data do not support a choice of one cell. The rule chooses " + found + ", but " +
         others + " " + format_rule(a) + " " + format_stability(a) +
         " Record more replicates or fabrics.";
}

std::string format_left_out(const SweepAnalysis& a) {
  std::string out;
  for (const std::string& one : a.without) out += "Skipped: " + one + "\n";
  for (std::size_t i = 0; i < std::min(a.left_out.size(), max_listed); ++i)
    out += "Skipped: " + format_cell(a, a.left_out[i].factors) + ": " + a.left_out[i].why + "\n";
  if (a.left_out.size() > max_listed)
    out += "Skipped: " + std::to_string(a.left_out.size() - max_listed) + " more cells\n";
  return out;
}

}  // namespace weft::daemon
