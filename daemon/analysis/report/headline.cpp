#include "daemon/analysis/report/headline.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "classifier/evaluate/evaluate.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/interval_text.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "recipes/engine/handover.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;

/// The label of every complete trial of the exploration, or of every imprint.
std::vector<std::string> labels_of_model(const Dataset& dataset, const std::string& exploration) {
  std::vector<std::string> out;
  if (holds_imprints(dataset)) {
    if (const auto imprints = extract_imprints(dataset))
      for (const auto& one : *imprints) out.push_back(one.label);
  } else {
    for (const classifier::Trial& trial : complete_trials(dataset, exploration))
      out.push_back(trial.label);
  }
  return out;
}

/// A handover tests every trial once.
void add_balance(const std::vector<std::string>& tested, Headline& headline) {
  std::map<std::string_view, std::size_t> count;
  std::size_t most = 0;
  for (const std::string& label : tested) most = std::max(most, ++count[label]);
  headline.labels = count.size();
  if (!tested.empty())
    headline.base_rate = static_cast<double>(most) / static_cast<double>(tested.size());
}

constexpr const char* by_repetition = "cross-validated by group of repetitions";

/// "lda" or "lda, svc": the recipes chosen in the splits.
std::string format_chosen(const classifier::Evaluation& evaluation) {
  std::set<std::string> names;
  for (const classifier::Recipe& recipe : evaluation.recipes) names.insert(to_string(recipe));
  return joined(std::vector<std::string>(names.begin(), names.end()), " or ");
}

/// Keeps labels that occur in two groups. In an incomplete campaign, the others can be neither
/// trained nor tested.
std::vector<classifier::Split> usable(std::vector<classifier::Split> splits,
                                      const classifier::FeatureMatrix& matrix) {
  std::map<std::string_view, std::size_t> groups;
  for (const classifier::Split& split : splits)
    for (const std::string& label : classifier::labels_in(matrix, split.test))
      ++groups[*std::ranges::find(matrix.labels, label)];
  const auto alone = [&](std::size_t row) { return groups[matrix.labels[row]] < 2; };
  for (classifier::Split& split : splits) {
    std::erase_if(split.train, alone);
    std::erase_if(split.test, alone);
  }
  std::erase_if(splits, [&](const classifier::Split& split) {
    return split.test.empty() || classifier::labels_in(matrix, split.train).size() < 2;
  });
  return splits;
}

Result<std::vector<Headline>> measure_exploration(const Dataset& dataset,
                                                  const std::string& exploration,
                                                  const classifier::TrainOptions& options) {
  std::vector<std::uint32_t> repetition;
  for (const TrialRecord& record : dataset.records)
    if (record.outcome == TrialOutcome::complete && record.spec.exploration == exploration)
      repetition.push_back(record.spec.repetition);
  if (repetition.empty() || std::ranges::min(repetition) == 0) return std::vector<Headline>{};
  auto matrix =
      classifier::build_feature_matrix(complete_trials(dataset, exploration), {}, options.threads);
  if (!matrix) return pass(matrix.error());
  const recipes::Handover defaults;
  const auto splits = usable(
      splits_by_repetition(
          repetition, recipes::repetition_groups(std::ranges::max(repetition), defaults.groups)),
      *matrix);
  if (splits.empty()) return std::vector<Headline>{};
  auto evaluation = classifier::evaluate(*matrix, splits, classifier::Learner::best, options);
  if (!evaluation) return pass(evaluation.error());
  name_groups_left_out(*evaluation);
  Headline out{exploration,   format_chosen(*evaluation),
               by_repetition, evaluation->confusion.total(),
               "trials",      {evaluation->accuracy, evaluation->ci95.low, evaluation->ci95.high}};
  std::vector<std::string> tested;
  for (const classifier::Split& split : splits)
    for (const std::size_t row : split.test) tested.push_back(matrix->labels[row]);
  add_balance(tested, out);
  out.confusion = std::move(evaluation->confusion);
  out.confusion_unit = out.unit;
  const std::set<std::string> all(matrix->labels.begin(), matrix->labels.end());
  std::ranges::set_difference(all, std::set<std::string>(tested.begin(), tested.end()),
                              std::back_inserter(out.not_tested));
  return std::vector{std::move(out)};
}

/// Nothing if the lists are not a matrix of numbers.
std::optional<classifier::Confusion> confusion_from(const ordered_json& labels,
                                                    const ordered_json& count) {
  const auto are_all = [](const ordered_json& list, auto is) {
    return list.is_array() && std::ranges::all_of(list, is);
  };
  if (!are_all(labels, [](const ordered_json& one) { return one.is_string(); })) return {};
  classifier::Confusion out(labels.get<std::vector<std::string>>());
  const auto is_count = [](const ordered_json& one) { return one.is_number_unsigned(); };
  const auto is_row = [&](const ordered_json& row) {
    return row.size() == labels.size() && are_all(row, is_count);
  };
  const bool is_flat = count.size() == labels.size() * labels.size() && are_all(count, is_count);
  if (!is_flat && (count.size() != labels.size() || !are_all(count, is_row))) return {};
  out.count.clear();
  for (const ordered_json& one : count)
    for (const ordered_json& value : is_flat ? ordered_json::array({one}) : one)
      out.count.push_back(value.get<std::size_t>());
  return out;
}

ordered_json share_json(const HandoverShare& share) {
  return {{"accuracy", share.share}, {"ci95", {share.ci95_low, share.ci95_high}}};
}

}  // namespace

std::vector<classifier::Split> splits_by_repetition(const std::vector<std::uint32_t>& repetition,
                                                    const std::vector<std::size_t>& group_of) {
  std::vector<classifier::Split> out;
  const std::set<std::size_t> groups(group_of.begin(), group_of.end());
  for (const std::size_t group : groups) {
    classifier::Split split;
    for (std::size_t row = 0; row < repetition.size(); ++row)
      (group_of.at(repetition[row] - 1) == group ? split.test : split.train).push_back(row);
    if (!split.test.empty()) out.push_back(std::move(split));
  }
  return out;
}

std::vector<Headline> handover_headlines(const HandoverResult& handover, const Dataset& dataset) {
  std::vector<Headline> out;
  const bool imprints = holds_imprints(dataset);
  for (const HandoverModel& model : handover.models)
    out.push_back({model.exploration,
                   model.learner,
                   imprints ? "cross-validated by object" : by_repetition,
                   model.requested,
                   imprints ? "imprints" : "trials",
                   {model.accuracy, model.ci95_low, model.ci95_high}});
  for (const HandoverEvaluation& one : handover.evaluations)
    out.push_back(
        {one.exploration, one.learner, by_repetition, one.recordings, "slides", one.slides});
  for (Headline& headline : out)
    add_balance(labels_of_model(dataset, headline.exploration), headline);
  return out;
}

void add_confusions(std::string_view evaluation_json, std::vector<Headline>& headlines) {
  const ordered_json json = ordered_json::parse(evaluation_json, nullptr, false);
  const auto explorations = json.is_object() ? json.find("explorations") : json.end();
  if (!json.is_object() || explorations == json.end()) return;
  for (Headline& headline : headlines) {
    if (!explorations->is_object() || !explorations->contains(headline.exploration)) continue;
    const ordered_json& one = (*explorations)[headline.exploration];
    const bool has_windows = one.contains("best");
    headline.confusion = has_windows
                             ? confusion_from(one["best"].value("labels", ordered_json()),
                                              one["best"].value("confusion", ordered_json()))
                         : one.contains("confusion")
                             ? confusion_from(one["confusion"].value("labels", ordered_json()),
                                              one["confusion"].value("count", ordered_json()))
                             : std::nullopt;
    headline.confusion_unit = has_windows ? "windows" : headline.unit;
  }
}

Result<std::vector<Headline>> measure_headlines(const Dataset& dataset, std::size_t threads) {
  classifier::TrainOptions options;
  options.threads = threads;
  std::vector<Headline> out;
  for (const std::string& exploration : list_explorations(dataset)) {
    auto one = measure_exploration(dataset, exploration, options);
    if (!one) return pass(one.error(), exploration);
    for (Headline& headline : *one) out.push_back(std::move(headline));
  }
  return out;
}

std::string headline_text(const Headline& headline) {
  const HandoverShare& a = headline.accuracy;
  return headline.exploration + ": " + percent(a.share, 1) + " % (95 %: " + percent(a.ci95_low, 1) +
         " to " + percent(a.ci95_high, 1) + ") of " + thousands(headline.tested) + " " +
         headline.unit + ", " + headline.learner + "; " + headline.protocol +
         "; most frequent of " + std::to_string(headline.labels) +
         " labels: " + percent(headline.base_rate, 1) + " %" +
         (headline.not_tested.empty()
              ? ""
              : "; not tested, no trials in another group: " + joined(headline.not_tested));
}

ordered_json headline_json(const Headline& headline) {
  ordered_json out{{"exploration", headline.exploration},
                   {"learner", headline.learner},
                   {"protocol", headline.protocol}};
  out.update(share_json(headline.accuracy));
  out.update(ordered_json{
      {"tested", headline.tested},
      {"unit", headline.unit},
      {"labels", headline.labels},
      {"not_tested", headline.not_tested},
      {"base_rate", headline.base_rate},
      {"chance", headline.labels == 0 ? 0.0 : 1.0 / static_cast<double>(headline.labels)}});
  return out;
}

std::vector<OtherProtocol> other_protocols(bool random_splits, bool learning_curve) {
  std::vector<OtherProtocol> out;
  if (random_splits)
    out.push_back({"results",
                   "Random splits, as in the paper: neighbouring repetitions are in both training "
                   "and test, and fewer trials are trained."});
  if (learning_curve)
    out.push_back({"design",
                   "Learning curve and forecast for more repetitions: one learner, trained on "
                   "fewer repetitions to compare sizes."});
  return out;
}

}  // namespace weft::daemon
