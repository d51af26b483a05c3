#include "daemon/analysis/design/design_page.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "classifier/base/random.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;
namespace design = classifier::design;

// each point and each draw needs one training per repetition left out
// (docs/explanation/campaign-design.md)
constexpr std::size_t reported_points = 5, reported_draws = 1;

Result<DesignParts> sweep_parts(const Dataset& dataset) {
  const auto analyses = analyse_sweep(std::span(&dataset, 1), {});
  if (!analyses) return pass(analyses.error());
  DesignParts out;
  ordered_json list = ordered_json::array();
  for (const SweepAnalysis& one : *analyses) {
    out.blocks += design_section(one);
    list.push_back(design_json(one));
  }
  out.json = ordered_json{{"sweeps", std::move(list)}}.dump();
  return out;
}

std::size_t repetitions_of(const std::vector<classifier::Trial>& trials) {
  std::set<std::string> groups;
  for (const classifier::Trial& trial : trials) groups.insert(trial.group);
  return groups.size();
}

Result<RepetitionStudy> run_study(const Dataset& dataset, const std::string& exploration,
                                  const std::vector<classifier::Trial>& trials, std::size_t threads,
                                  const std::function<bool()>& stop) {
  const auto features = classifier::build_feature_matrix(trials, {}, threads);
  if (!features) return pass(features.error());
  design::CurveOptions options;
  options.draws = reported_draws;
  options.most_points = reported_points;
  options.threads = threads;
  options.stop = stop;
  auto curve = design::learning_curve(by_repetition(*features, dataset, {}), options);
  if (!curve) return pass(curve.error());
  design::ForecastOptions wanted;
  wanted.predict = 2 * curve->repetitions;
  const auto forecast = design::forecast_repetitions(*curve, wanted);
  if (!forecast) return pass(forecast.error());
  return RepetitionStudy{dataset.info.kind, dataset_sha256(dataset),
                         exploration,       std::string(classifier::to_string(options.learner)),
                         std::move(*curve), *forecast};
}

/// Zero-padded, so that text sorts like the number.
std::string padded(std::size_t number) {
  const std::string digits = std::to_string(number);
  return std::string(10 - std::min<std::size_t>(10, digits.size()), '0') + digits;
}

/// Repetition numbers, or the groups' names. They cannot be matched with each other, so one kind is
/// used for all rows.
std::vector<std::string> recorded_repetitions(const classifier::FeatureMatrix& matrix,
                                              const Dataset& dataset) {
  std::map<std::string_view, std::uint32_t> of_file;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    of_file[dataset.trials[i].file] = dataset.records[i].spec.repetition;
  std::vector<std::string> out;
  for (const std::string& file : matrix.files) {
    const auto found = of_file.find(file);
    if (found == of_file.end() || found->second == 0) return matrix.groups;
    out.push_back(padded(found->second));
  }
  return out;
}

std::vector<std::string> drawn_repetitions(const classifier::FeatureMatrix& matrix,
                                           std::uint64_t seed) {
  std::map<std::string, std::vector<std::size_t>> of_label;
  for (std::size_t i = 0; i < matrix.size(); ++i) of_label[matrix.labels[i]].push_back(i);
  std::vector<std::string> out(matrix.size());
  classifier::RandomEngine engine(seed);
  for (auto& [label, rows] : of_label) {
    classifier::shuffle(rows, engine);
    for (std::size_t k = 0; k < rows.size(); ++k) out[rows[k]] = padded(k + 1);
  }
  return out;
}

/// Sorted names of the groups that have every label.
std::vector<std::string> complete_groups(const classifier::FeatureMatrix& matrix) {
  const std::set<std::string> labels(matrix.labels.begin(), matrix.labels.end());
  std::map<std::string, std::set<std::string>> of_group;
  for (std::size_t i = 0; i < matrix.size(); ++i)
    of_group[matrix.groups[i]].insert(matrix.labels[i]);
  std::vector<std::string> out;
  for (const auto& [name, present] : of_group)
    if (present.size() == labels.size()) out.push_back(name);
  return out;
}

ordered_json interval_json(const classifier::Interval& interval) {
  return {interval.low, interval.high};
}

ordered_json value_json(const char* name, const CellValue& value) {
  return {{name, value.value}, {"ci95", interval_json(value.ci95)}};
}

ordered_json factors_json(const SweepAnalysis& a, const std::vector<double>& factors) {
  ordered_json out;
  for (std::size_t f = 0; f < a.factors.size(); ++f) out[a.factors[f]] = factors[f];
  return out;
}

ordered_json cell_json(const SweepAnalysis& a, std::size_t i) {
  const SweepCell& cell = a.cells[i];
  const auto& summary = a.choice.cells[i];
  return {{"factors", factors_json(a, cell.factors)},
          {"trials", cell.trials},
          {"separability",
           {{"accuracy", summary.figures.accuracy}, {"ci95", interval_json(summary.ci95)}}},
          {"snr_db", value_json("mean", cell.snr_db)},
          {"saturated_share", value_json("mean", cell.saturated_share)},
          {"seconds", value_json("median", cell.seconds)},
          {"on_front", on_front(a, i)},
          {"chosen_share", summary.chosen_share}};
}

template <class Value>
ordered_json or_null(const std::optional<Value>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

}  // namespace

DesignParts analyse_design(const Dataset& dataset,
                           const std::function<void(const std::string&)>& progress,
                           std::size_t threads, const std::function<bool()>& stop) {
  if (!dataset.info.factors.empty()) {
    progress("cells of the sweep");
    auto parts = sweep_parts(dataset);
    if (parts) return std::move(*parts);
    progress("skipped: " + to_string(parts.error()));
    return {};
  }
  DesignParts out;
  ordered_json list = ordered_json::array();
  for (const std::string& exploration : list_explorations(dataset)) {
    const auto trials = complete_trials(dataset, exploration);
    if (repetitions_of(trials) < least_reported_repetitions) continue;
    progress("learning curve of " + exploration);
    const auto study = run_study(dataset, exploration, trials, threads, stop);
    if (study) {
      out.blocks += design_section(*study);
      list.push_back(design_json(*study));
    } else {
      progress("skipped: " + to_string(study.error()));
    }
  }
  if (!list.empty()) out.json = ordered_json{{"repetitions", std::move(list)}}.dump();
  return out;
}

classifier::FeatureMatrix by_repetition(const classifier::FeatureMatrix& matrix,
                                        const Dataset& dataset, const RepetitionChoice& choice) {
  classifier::FeatureMatrix out = matrix;
  out.groups = choice.strokes ? drawn_repetitions(matrix, choice.seed)
                              : recorded_repetitions(matrix, dataset);
  std::vector<std::string> names = complete_groups(out);
  if (choice.first > 0) names.resize(std::min(names.size(), choice.first));
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < out.size(); ++i)
    if (std::ranges::binary_search(names, out.groups[i])) rows.push_back(i);
  return classifier::select_rows(out, rows);
}

std::string format_repetition_study(const RepetitionStudy& study) {
  const auto& last = study.curve.points.back();
  const auto& f = study.forecast;
  std::string out = std::to_string(study.curve.repetitions) + " repetitions of " +
                    std::to_string(study.curve.fabrics) + " fabrics: " + percent(last.accuracy) +
                    " % accuracy, cross-validated by repetition (95 %: " + percent(last.ci95.low) +
                    " to " + percent(last.ci95.high) + " %). " + std::to_string(f.predict) +
                    " repetitions should give " + percent(f.accuracy) +
                    " % (95 % prediction interval: " + percent(f.ci95.low) + " to " +
                    percent(f.ci95.high) + " %). ";
  const std::string wanted = percent(f.wanted) + " %";
  if (!f.enough)
    return out + wanted + " accuracy is not reached within " + std::to_string(f.most) +
           " repetitions (" + percent(f.reached_share, 0) + " % of the resamples reach it).";
  out += wanted + " accuracy needs " + std::to_string(*f.enough) + " repetitions";
  out += f.enough_low ? " (95 %: " + std::to_string(*f.enough_low) + " to " +
                            (f.enough_high ? std::to_string(*f.enough_high)
                                           : "more than " + std::to_string(f.most)) +
                            ")."
                      : ".";
  return out;
}

ordered_json design_json(const SweepAnalysis& a) {
  ordered_json cells = ordered_json::array(), front = ordered_json::array(),
               surest = ordered_json::array(), left_out = ordered_json::array();
  for (const LeftOutCell& one : a.left_out)
    left_out.push_back({{"factors", factors_json(a, one.factors)}, {"why", one.why}});
  for (std::size_t i = 0; i < a.cells.size(); ++i) cells.push_back(cell_json(a, i));
  for (const std::size_t i : a.choice.front) front.push_back(factors_json(a, a.cells[i].factors));
  for (const FactorShare& one : a.surest)
    surest.push_back(
        {{"factor", a.factors[one.factor]}, {"value", one.value}, {"share", one.share}});
  return {{"bench", to_string(a.bench)},
          {"exploration", a.exploration},
          {"dataset_sha256", a.datasets},
          {"factors", a.factors},
          {"fabrics", a.fabrics},
          {"replicates", a.replicates},
          {"learner", a.learner},
          {"band_m", {a.band.shortest_m, a.band.longest_m}},
          {"cells", std::move(cells)},
          {"front", std::move(front)},
          {"left_out", std::move(left_out)},
          {"explorations_left_out", a.without},
          {"design_effect", a.choice.design_effect},
          {"recommendation",
           {{"supported", a.choice.supported},
            {"factors", factors_json(a, a.cells[a.choice.chosen].factors)},
            {"share", a.choice.share},
            {"resamples", a.choice.resamples},
            {"surest", std::move(surest)},
            {"overlapping", a.choice.overlapping},
            {"quicker_overlapping", a.choice.quicker_overlapping},
            {"words", recommendation(a)}}}};
}

ordered_json design_json(const RepetitionStudy& study) {
  ordered_json points = ordered_json::array();
  for (const auto& p : study.curve.points)
    points.push_back({{"repetitions", p.repetitions},
                      {"accuracy", p.accuracy},
                      {"ci95", interval_json(p.ci95)}});
  const auto& f = study.forecast;
  return {{"bench", to_string(study.bench)},
          {"exploration", study.exploration},
          {"dataset_sha256", study.dataset},
          {"learner", study.learner},
          {"fabrics", study.curve.fabrics},
          {"repetitions", study.curve.repetitions},
          {"trials", study.curve.trials},
          {"draws", study.curve.draws},
          {"curve", std::move(points)},
          {"law", {{"floor", f.law.floor}, {"scale", f.law.scale}, {"exponent", f.law.exponent}}},
          {"predicted",
           {{"repetitions", f.predict},
            {"accuracy", f.accuracy},
            {"interval95", interval_json(f.ci95)}}},
          {"wanted",
           {{"accuracy", f.wanted},
            {"most", f.most},
            {"repetitions", or_null(f.enough)},
            {"low", or_null(f.enough_low)},
            {"high", or_null(f.enough_high)},
            {"reached_share", f.reached_share}}},
          {"words", format_repetition_study(study)}};
}

}  // namespace weft::daemon
