#include "daemon/apps/weft/trial_choice.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "classifier/features/layout.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/imprint_features.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/dataset/sample_times.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::Trial;

// Whether each combination of the factors of a sweep is one exploration. Such a cell is identified
// by its columns.
bool has_varied_factors(const Dataset& dataset) {
  std::map<std::vector<double>, std::string> exploration;
  for (const TrialRecord& record : dataset.records) {
    const auto at = exploration.emplace(record.spec.factors, record.spec.exploration).first;
    if (at->second != record.spec.exploration) return false;
  }
  return !dataset.info.factors.empty();
}

}  // namespace

Result<std::optional<std::string>> find_exploration(const Dataset& dataset,
                                                    const std::string& wanted,
                                                    bool one_exploration) {
  const std::vector<std::string> present = list_explorations(dataset);
  if (present.empty())
    return fail({.code = Errc::not_found, .what = "no complete trial in the data set"});
  if (wanted.empty()) {
    if (present.size() == 1) return present.front();
    if (!one_exploration && has_varied_factors(dataset)) return std::nullopt;
    return fail({.code = Errc::invalid_argument,
                 .what = "several explorations in the data set",
                 .got = joined(present),
                 .hint = "Choose one with --exploration"});
  }
  if (wanted.find('+') != std::string::npos)
    return fail({.code = Errc::unsupported,
                 .where = "--exploration",
                 .what = "more than one exploration for a model",
                 .expected = joined(present),
                 .got = wanted,
                 .hint = "Use weft fabric evaluate or features for several explorations"});
  if (std::ranges::find(present, wanted) == present.end())
    return fail({.code = Errc::not_found,
                 .where = "--exploration",
                 .what = "exploration not in the data set",
                 .expected = joined(present),
                 .got = wanted});
  return wanted;
}

namespace {

classifier::FeatureSetup make_setup(const TrialSelection& chosen, const TrialChoice& choice,
                                    double period_s) {
  classifier::FeatureSetup setup;
  setup.taxels = chosen.trials.front().taxels;
  setup.phases = classifier::phases_of(chosen.trials.front());
  setup.options.norm = choice.norm == "rms" ? classifier::Norm::rms : classifier::Norm::l2;
  setup.window_s = choice.window_s;
  setup.window_step_s = choice.window_step_s;
  setup.sample_period_s = period_s;
  setup.exploration = chosen.exploration;
  return setup;
}

}  // namespace

namespace {

/// Sets each row's group from a column.
template <class Data, class Rows>
Status group_by(const Data& data, Rows& rows, std::string_view column) {
  const auto labels = group_labels(data, column);
  if (!labels) return pass(labels.error(), "--group");
  for (std::size_t r = 0; r < labels->size(); ++r) rows[r].group = (*labels)[r];
  return {};
}

}  // namespace

Status set_groups(Dataset& dataset, std::string_view by) {
  return group_by(dataset, dataset.trials, by);
}

Status set_groups(RecordingSet& set, std::string_view by) {
  return group_by(set, set.recordings, by);
}

void add_group_option(CLI::App& command, std::string& group) {
  command
      .add_option("--group", group,
                  "group trials by this column (recorded, repetition, mounting, piece, patch, ...)")
      ->capture_default_str();
}

void add_trial_options(CLI::App& command, const LearningOptions& options, TrialChoice& choice) {
  command.add_option("--exploration", choice.exploration, "use only this exploration, such as M1");
  command
      .add_option("--window-s", choice.window_s,
                  options.modality() == classifier::Modality::vibro
                      ? "set the length of a window [s]"
                      : "cut phase M into windows of this length [s]")
      ->check(number_range(1e-3, 1e6));
  command
      .add_option(options.name_of("--window-step-s"), choice.window_step_s,
                  "set the time from one window to the next [s]")
      ->check(number_range(1e-3, 1e6))
      ->needs("--window-s");
  add_keyword(command, "--norm", choice.norm, {"l2", "rms"},
              "compute F_norm by l2 as in the paper, or by rms");
  add_group_option(command, choice.group);
  command
      .add_option("--scales", choice.scales,
                  "smooth imprints at these scales [taxels] (comma-separated)")
      ->capture_default_str();
  command
      .add_option(options.name_of("--imprint-features"), choice.imprint_features,
                  "use these imprint features or their sum (10, 7, steps, extrema, laws3, ...)")
      ->capture_default_str();
  add_edge_options(command, choice.edges);
}

void add_level_option(CLI::App& command, TrialChoice& choice) {
  command
      .add_option("--remove-level", choice.remove_level,
                  "subtract each taxel's mean of the motion, or of the rest before it")
      ->check(CLI::IsMember({"motion", "rest"}));
}

Status remove_level(Trial& trial, const TrialChoice& choice) {
  if (choice.remove_level.empty()) return {};
  return classifier::without_level(trial,
                                   choice.remove_level == "rest" ? Phase::rest : Phase::motion);
}

Status check_command(const TrialChoice& choice, DataKind kind) {
  using classifier::Modality;
  const Modality of_data = kind == DataKind::slides     ? Modality::fabric
                           : kind == DataKind::imprints ? Modality::imprint
                                                        : Modality::vibro;
  if (choice.modality && *choice.modality != of_data)
    return fail({.code = Errc::invalid_argument,
                 .what = "data of another kind",
                 .expected = "data for weft " + std::string(to_string(*choice.modality)),
                 .got = std::string(describe_kind(kind)),
                 .hint = "Use weft " + std::string(to_string(of_data))});
  return check_given(choice.given, kind);
}

DataKind kind_of(const Dataset& dataset) {
  return holds_imprints(dataset) ? DataKind::imprints : DataKind::slides;
}

double sample_period_s(const Dataset& dataset) {
  return dataset.info.taxel_rate_hz > 0.0 ? 1.0 / dataset.info.taxel_rate_hz : 0.0;
}

namespace {

std::vector<std::size_t> select_chosen(const Dataset& dataset,
                                       const std::optional<std::string>& exploration) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < dataset.records.size(); ++i) {
    const TrialRecord& record = dataset.records[i];
    const bool chosen = !exploration || record.spec.exploration == *exploration;
    if (record.outcome == TrialOutcome::complete && chosen) out.push_back(i);
  }
  return out;
}

std::string format_rate(double period_s) {
  return std::to_string(period_s) + " s (" + fixed(1 / period_s, 2) + " Hz)";
}

// Windows of one length and a model need one rate: checks that the trials share one.
Status one_rate(const Dataset& dataset, const std::optional<std::string>& exploration) {
  const std::vector<std::size_t> trials = select_chosen(dataset, exploration);
  std::vector<std::vector<std::int64_t>> times;
  for (const std::size_t i : trials) times.push_back(motion_times(dataset, i));
  const double period_s = common_period_s(times);
  const auto odd = std::ranges::find_if_not(
      trials, [&](std::size_t i) { return can_have_period(motion_times(dataset, i), period_s); });
  if (odd == trials.end() || period_s == 0.0) return {};
  const auto own_s = [&](std::size_t i) {
    return sampled_time(motion_times(dataset, i)).period_s();
  };
  const std::size_t other =
      std::ranges::max(trials, {}, [&](std::size_t i) { return std::abs(own_s(i) - own_s(*odd)); });
  return fail({.code = Errc::invalid_argument,
               .where = dataset.trials[*odd].file + " and " + dataset.trials[other].file,
               .what = "different sampling rates",
               .expected = "all within " + percent(rate_tolerance, 0) + " % of " +
                           fixed(1 / period_s, 2) + " Hz",
               .got = fixed(1 / own_s(*odd), 2) + " Hz and " + fixed(1 / own_s(other), 2) + " Hz",
               .hint = "Make one data set per rate, or resample to one rate"});
}

}  // namespace

Status check_rate(const Dataset& dataset, const std::optional<std::string>& exploration,
                  double period_s) {
  if (period_s == 0.0) return {};  // unknown
  for (const std::size_t i : select_chosen(dataset, exploration)) {
    const std::vector<std::int64_t> t_ns = motion_times(dataset, i);
    if (can_have_period(t_ns, period_s)) continue;
    return fail({.code = Errc::invalid_argument,
                 .where = dataset.trials[i].file,
                 .what = "sampling rate differs from that of the training trials",
                 .expected = format_rate(period_s),
                 .got = format_rate(sampled_time(t_ns).period_s())});
  }
  return {};
}

Result<TrialSelection> choose_trials(const Dataset& dataset, const TrialChoice& choice,
                                     bool one_exploration) {
  const auto exploration = find_exploration(dataset, choice.exploration, one_exploration);
  if (!exploration) return pass(exploration.error());
  if (one_exploration || choice.window_s != 0.0)
    if (Status same = one_rate(dataset, *exploration); !same) return pass(same.error());
  TrialSelection out{exploration->value_or(""), select_chosen(dataset, *exploration).size(), {}};
  auto trials = in_windows(dataset, *exploration,
                           {choice.window_s, choice.window_step_s, sample_period_s(dataset)});
  if (!trials) return pass(trials.error());
  out.trials = std::move(*trials);
  return out;
}

Result<std::vector<Trial>> in_windows(const Dataset& dataset,
                                      const std::optional<std::string>& exploration,
                                      const classifier::WindowOptions& options) {
  if (options.window_s == 0.0) return complete_trials(dataset, exploration);
  if (!(options.sample_period_s > 0.0))
    return fail({.code = Errc::invalid_argument,
                 .what = "sampling rate unknown, so no window can be cut",
                 .hint = "State the rate with weft dataset import --rate-hz"});
  std::vector<Trial> out;
  for (const std::size_t i : select_chosen(dataset, exploration)) {
    auto windows = classifier::cut_windows(dataset.trials[i], options,
                                           samples_after_pause(dataset.records[i].t_ns));
    if (!windows) return pass(windows.error());
    std::move(windows->begin(), windows->end(), std::back_inserter(out));
  }
  return out;
}

namespace {

Result<classifier::FeatureMatrix> compute_features(std::vector<Trial> trials,
                                                   const TrialChoice& choice,
                                                   const classifier::FeatureOptions& options) {
  for (Trial& trial : trials)
    if (auto ok = remove_level(trial, choice); !ok) return pass(ok.error());
  return classifier::build_feature_matrix(trials, options);
}

using TrialKey = std::tuple<std::string, std::string, std::uint32_t>;  // label, group, repetition

// Complete trials of one exploration, by the key shared with another; the last attempt of a
// repetition counts.
std::map<TrialKey, std::size_t> trials_by_key(const Dataset& dataset, const std::string& name) {
  std::map<TrialKey, std::size_t> out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const TrialRecord& record = dataset.records[i];
    if (record.outcome == TrialOutcome::complete && record.spec.exploration == name)
      out[{dataset.trials[i].label, dataset.trials[i].group, record.spec.repetition}] = i;
  }
  return out;
}

// Joins the features of several explorations side by side.
Result<ChosenTrials> load_joined(const Dataset& dataset, const TrialChoice& choice,
                                 bool one_exploration) {
  if (choice.window_s != 0.0)
    return fail({.code = Errc::invalid_argument,
                 .where = "--window-s",
                 .what = "option not possible with several explorations"});
  std::vector<std::map<TrialKey, std::size_t>> trials;
  const auto sum = explorations_in(choice.exploration);
  if (!sum) return pass(sum.error());
  const std::vector<std::string>& parts = *sum;
  for (const std::string& name : parts) {
    trials.push_back(trials_by_key(dataset, name));
    if (trials.back().empty())
      return fail({.code = Errc::not_found,
                   .where = "--exploration",
                   .what = "exploration not in the data set",
                   .expected = joined(list_explorations(dataset)),
                   .got = name});
    if (one_exploration)
      if (Status same = one_rate(dataset, name); !same) return pass(same.error());
  }
  std::erase_if(trials.front(), [&](const auto& entry) {
    return !std::ranges::all_of(trials, [&](const auto& t) { return t.contains(entry.first); });
  });
  if (trials.front().empty())
    return fail({.code = Errc::not_found,
                 .where = "--exploration",
                 .what = "no repetition with a trial of each exploration",
                 .got = choice.exploration});
  ChosenTrials out;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    TrialSelection selection{choice.exploration, 0, {}};
    for (const auto& entry : trials.front())
      selection.trials.push_back(dataset.trials[trials[p].at(entry.first)]);
    out.setup = make_setup(selection, choice, sample_period_s(dataset));
    const auto features = compute_features(std::move(selection.trials), choice, out.setup.options);
    if (!features) return pass(features.error());
    append_columns(*features, parts[p] + ":", out.features);
  }
  out.strokes = out.features.size();
  return out;
}

MotionLengths measure_lengths(const std::vector<Trial>& strokes) {
  std::vector<std::size_t> samples;
  for (const Trial& stroke : strokes) samples.push_back(stroke.motion_samples());
  const auto [shortest, longest] = std::ranges::minmax(samples);
  return {shortest, longest};
}

Result<ChosenTrials> load_slides(const Dataset& dataset, const TrialChoice& choice,
                                 bool one_exploration) {
  Result<TrialSelection> chosen = choose_trials(dataset, choice, one_exploration);
  if (!chosen) return pass(chosen.error());
  ChosenTrials out;
  out.strokes = chosen->strokes;
  out.setup = make_setup(*chosen, choice, sample_period_s(dataset));
  if (choice.window_s == 0.0) out.motion = measure_lengths(chosen->trials);
  out.digests = classifier::content_digests(chosen->trials);
  auto features = compute_features(std::move(chosen->trials), choice, out.setup.options);
  if (!features) return pass(features.error());
  out.features = std::move(*features);
  return out;
}

bool names_several(const TrialChoice& choice) {
  return choice.exploration.find('+') != std::string::npos;
}

}  // namespace

Result<classifier::FeatureMatrix> features_without_level(const ChosenTrials& chosen,
                                                         TrialChoice choice) {
  choice.remove_level = "motion";
  auto out = names_several(choice) ? load_joined(chosen.dataset, choice, false)
                                   : load_slides(chosen.dataset, choice, false);
  if (!out) return pass(out.error());
  return std::move(out->features);
}

Result<ChosenTrials> load_trials(const std::filesystem::path& path, const TrialChoice& choice,
                                 bool one_exploration, bool can_join) {
  if (choice.modality && is_recordings_file(path))
    if (auto ok = check_command(choice, DataKind::whole_recordings); !ok)
      return pass(ok.error(), path.string());
  Result<Dataset> dataset = open_dataset(path);
  if (!dataset) return pass(dataset.error());
  if (auto ok = check_command(choice, kind_of(*dataset)); !ok)
    return pass(ok.error(), path.string());
  const bool is_sum = can_join && names_several(choice);
  if (is_sum && choice.group != "recorded")
    return fail({.code = Errc::unsupported,
                 .where = "--group",
                 .what = "option not possible with several explorations",
                 .got = choice.group,
                 .hint = "Choose one exploration"});
  const std::string sha256 = dataset_sha256(*dataset);
  if (auto ok = set_groups(*dataset, choice.group); !ok) return pass(ok.error(), path.string());
  auto out = is_sum                     ? load_joined(*dataset, choice, one_exploration)
             : holds_imprints(*dataset) ? load_imprints(*dataset, choice)
                                        : load_slides(*dataset, choice, one_exploration);
  if (!out) return pass(out.error(), path.string());
  out->sha256 = sha256;
  out->dataset = std::move(*dataset);
  return out;
}

std::string bench_banner(BenchKind kind) {
  switch (kind) {
    case BenchKind::simulated:
      return "SIMULATED data: computed by the plant model; no real fabric was touched.\n";
    case BenchKind::unknown:
      return "Data of unknown origin: the file does not name the bench.\n";
    case BenchKind::real:
      return {};
  }
  return {};
}

std::string bench_banner(const DatasetInfo& info) {
  const std::string selected = format_selection(info);
  return bench_banner(info.kind) + (selected.empty() ? "" : selected + "\n");
}

}  // namespace weft::daemon::cli
