#include "daemon/apps/weft/audit_tables.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <set>

#include "classifier/vibro/extract.hpp"
#include "classifier/vibro/protocol.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/dataset/sample_times.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::FeatureMatrix;
using classifier::Trial;

// Values of each row; empty if the data set does not have them.
using Rows = std::vector<std::vector<double>>;

constexpr const char* not_recorded = "not recorded";

/// Columns that are the same in all rows predict nothing and are left out.
void add_probe(AuditTables& tables, const std::string& name, const Rows& rows,
               const std::string& absent_because = not_recorded) {
  const bool recorded = !rows.empty() && std::ranges::none_of(rows, [&](const auto& row) {
    return row.empty() || row.size() != rows.front().size();
  });
  if (!recorded) return tables.absent.emplace_back(name, absent_because), void();
  std::vector<std::size_t> varied;
  for (std::size_t c = 0; c < rows.front().size(); ++c)
    if (std::ranges::any_of(rows, [&](const auto& row) { return row[c] != rows.front()[c]; }))
      varied.push_back(c);
  if (varied.empty())
    return tables.absent.emplace_back(name, "the same in all " + tables.rows), void();
  FeatureMatrix matrix{{},
                       classifier::Matrix(rows.size(), varied.size()),
                       tables.full.labels,
                       tables.full.groups,
                       tables.full.files};
  for (std::size_t k = 0; k < varied.size(); ++k) {
    matrix.names.push_back(name + " " + std::to_string(varied[k] + 1));
    for (std::size_t r = 0; r < rows.size(); ++r) matrix.values(r, k) = rows[r][varied[k]];
  }
  tables.probes.push_back({name, std::move(matrix)});
}

/// Mean, deviation and range of every taxel in phase S.
std::vector<double> rest_figures(const Trial& trial) {
  std::vector<double> out;
  for (std::size_t pad = 0; pad < trial.taxels; ++pad) {
    std::vector<double> values;
    for (std::size_t i = 0; i < trial.samples(); ++i)
      if (trial.phase[i] == Phase::rest) values.push_back(trial.row(i)[pad]);
    if (values.empty()) return {};
    const auto [low, high] = std::ranges::minmax(values);
    out.insert(out.end(), {classifier::compute_mean(values), classifier::compute_deviation(values),
                           high - low});
  }
  return out;
}

/// Mean of every taxel in phase M.
std::vector<double> pad_levels(const Trial& trial) {
  std::vector<double> out(trial.taxels, 0.0);
  for (std::size_t i = 0; i < trial.samples(); ++i)
    if (trial.phase[i] == Phase::motion)
      for (std::size_t pad = 0; pad < trial.taxels; ++pad) out[pad] += trial.row(i)[pad];
  for (double& level : out) level /= static_cast<double>(trial.motion_samples());
  return out;
}

/// Levels divided by their sum, so the total pressure has no effect. Empty for a single taxel.
std::vector<double> pad_pattern(const Trial& trial) {
  std::vector<double> out = pad_levels(trial);
  const double sum = std::accumulate(out.begin(), out.end(), 0.0);
  if (out.size() < 2 || !(sum > 0.0)) return {};
  for (double& level : out) level /= sum;
  return out;
}

/// Seconds and samples of each phase.
std::vector<double> durations(const Trial& trial, const TrialRecord& record) {
  std::vector<double> out;
  for (const Phase phase : {Phase::rest, Phase::press, Phase::motion, Phase::end}) {
    double samples = 0.0, first_s = 0.0, last_s = 0.0;
    for (std::size_t i = 0; i < trial.samples(); ++i) {
      if (trial.phase[i] != phase) continue;
      last_s = static_cast<double>(record.t_ns[i]) / 1e9;
      if (samples == 0.0) first_s = last_s;
      ++samples;
    }
    out.insert(out.end(), {samples, last_s - first_s});
  }
  return out;
}

std::vector<double> lost_frames(const TrialRecord& record) {
  return {static_cast<double>(record.lost_samples),
          static_cast<double>(samples_after_pause(record.t_ns).size())};
}

std::vector<double> force_error(const TrialRecord& record) {
  const TrialQuality& quality = record.quality;
  if (!quality.force_rms_error_n) return {};
  return {*quality.force_rms_error_n, quality.force_in_band_fraction.value_or(1.0)};
}

/// Repetition and start, which is on one clock where no two trials overlap; of a campaign the place
/// in its plan as well. That of an import is the order of its files.
Rows order_and_time(const Dataset& dataset, const std::vector<std::size_t>& trials) {
  std::vector<std::pair<std::int64_t, std::int64_t>> spans;
  for (const std::size_t i : trials)
    if (const auto& t = dataset.records[i].t_ns; !t.empty())
      spans.emplace_back(t.front(), t.back());
  std::ranges::sort(spans);
  bool one_clock = spans.size() == trials.size();
  for (std::size_t k = 1; k < spans.size(); ++k)
    one_clock = one_clock && spans[k].first >= spans[k - 1].second;
  Rows out;
  for (const std::size_t i : trials) {
    const TrialRecord& record = dataset.records[i];
    std::vector<double> row{static_cast<double>(record.spec.repetition)};
    if (one_clock) row.push_back(static_cast<double>(record.t_ns.front()) / 1e9);
    if (dataset.info.source == "campaign") row.push_back(static_cast<double>(record.spec.index));
    out.push_back(std::move(row));
  }
  return out;
}

Rows rows_of(const std::vector<std::size_t>& trials,
             const std::function<std::vector<double>(std::size_t)>& row) {
  Rows out;
  for (const std::size_t i : trials) out.push_back(row(i));
  return out;
}

/// Those that have a value in each of `rows`: mounting and piece, then the others that the data set
/// names. Repetition and patch are of a campaign's plan, and probes of their own.
void add_columns(const std::vector<GroupColumn>& named, const std::vector<std::size_t>& rows,
                 AuditTables& tables) {
  const std::set<std::string_view> of_cloth{"mounting", "piece"}, of_plan{"repetition", "patch"};
  for (const GroupColumn& one : named) {
    if (of_plan.contains(one.name)) continue;
    AuditColumn column{one.name, {}, false, of_cloth.contains(one.name)};
    for (const std::size_t i : rows) column.of_row.push_back(one.of_row[i]);
    if (std::ranges::find(column.of_row, std::string()) == column.of_row.end())
      tables.columns.push_back(std::move(column));
  }
  std::ranges::stable_partition(tables.columns, &AuditColumn::of_cloth);
}

/// One column per value: 1 in the column of the row's value, else 0.
Rows indicators(const std::vector<std::string>& values) {
  const std::set<std::string> all(values.begin(), values.end());
  // Values that occur in one row each would only number the rows.
  const bool numbers_rows = 2 * all.size() > values.size();
  Rows rows;
  for (const std::string& own : values) {
    rows.emplace_back();
    if (!numbers_rows)
      for (const std::string& value : all) rows.back().push_back(own == value ? 1.0 : 0.0);
  }
  return rows;
}

Result<FeatureMatrix> changed_features(const ChosenTrials& chosen,
                                       const std::vector<std::size_t>& trials, bool level,
                                       bool pattern) {
  std::vector<Trial> out;
  for (const std::size_t i : trials) {
    Trial& trial = out.emplace_back(chosen.dataset.trials[i]);
    if (pattern) remove_pad_pattern(trial);
    if (!level) continue;
    if (auto ok = classifier::without_level(trial, Phase::motion); !ok) return pass(ok.error());
  }
  auto matrix = classifier::build_feature_matrix(out, chosen.setup.options);
  if (matrix) matrix->groups = chosen.features.groups;
  return matrix;
}

Status add_changed(const ChosenTrials& chosen, const std::vector<std::size_t>& trials,
                   AuditTables& tables) {
  const bool has_pattern = chosen.setup.taxels > 1;
  const auto add = [&](const char* name, bool level, bool pattern) -> Status {
    auto matrix = changed_features(chosen, trials, level, pattern);
    if (!matrix) return pass(matrix.error(), name);
    tables.changed.push_back({name, std::move(*matrix)});
    return {};
  };
  if (auto ok = add("without level", true, false); !ok || !has_pattern) return ok;
  if (auto ok = add("without pad pattern", false, true); !ok) return ok;
  return add("without level and pattern", true, true);
}

/// The mean of the windows of each recording, in the order of its first window.
FeatureMatrix mean_of_windows(const classifier::vibro::WindowSet& windows) {
  const FeatureMatrix& matrix = windows.matrix;
  std::map<std::size_t, std::vector<std::size_t>> rows;
  for (std::size_t r = 0; r < matrix.size(); ++r) rows[windows.recording[r]].push_back(r);
  FeatureMatrix out{matrix.names, classifier::Matrix(rows.size(), matrix.names.size()), {}, {}, {}};
  for (const auto& [recording, own] : rows) {
    for (std::size_t c = 0; c < matrix.names.size(); ++c)
      for (const std::size_t r : own)
        out.values(out.labels.size(), c) += matrix.values(r, c) / static_cast<double>(own.size());
    out.labels.push_back(matrix.labels[own.front()]);
    out.groups.push_back(matrix.groups[own.front()]);
    out.files.emplace_back(classifier::recording_of(std::string_view(matrix.files[own.front()])));
  }
  return out;
}

Result<FeatureMatrix> recording_features(std::span<const classifier::vibro::Recording> recordings,
                                         double window_s) {
  classifier::vibro::ProtocolOptions protocol;
  protocol.protocol = classifier::vibro::Protocol::groups;
  protocol.window_s = window_s;
  protocol.step_s = window_s;
  const auto windows = classifier::vibro::cut_and_extract(
      recordings, window_s, classifier::vibro::places_of(protocol),
      {classifier::vibro::Family::smmrpfft, classifier::vibro::Combine::concat});
  if (!windows) return pass(windows.error());
  if (windows->matrix.size() == 0)
    return fail({.code = Errc::invalid_argument,
                 .what = "all recordings shorter than a window",
                 .expected = "at least " + std::to_string(window_s) + " s"});
  return mean_of_windows(*windows);
}

double rms(const std::vector<double>& samples) {
  double sum = 0.0;
  for (const double x : samples) sum += x * x;
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

}  // namespace

void note_whole_columns(std::vector<AuditColumn>& columns, const FeatureMatrix& full,
                        std::span<const classifier::Split> splits) {
  for (AuditColumn& column : columns) {
    std::vector<std::string> keys;
    for (std::size_t r = 0; r < full.size(); ++r)
      keys.push_back(full.labels[r] + '\n' + column.of_row[r]);
    column.whole = classifier::groups_on_both_sides(splits, keys).empty();
  }
}

std::vector<std::size_t> trials_of_rows(const Dataset& dataset, const FeatureMatrix& full) {
  std::map<std::string_view, std::size_t> place;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) place[dataset.trials[i].file] = i;
  std::vector<std::size_t> out;
  for (const std::string& file : full.files) out.push_back(place.at(file));
  return out;
}

void remove_pad_pattern(Trial& trial) {
  const std::vector<double> levels = pad_levels(trial);
  const double mean = classifier::compute_mean(levels);
  for (std::size_t i = 0; i < trial.counts.size(); ++i)
    if (const double level = levels[i % trial.taxels]; level > 0.0 && mean > 0.0)
      trial.counts[i] *= mean / level;
}

Result<AuditTables> slide_tables(const ChosenTrials& chosen) {
  const Dataset& dataset = chosen.dataset;
  AuditTables out{"trials", chosen.features, {}, {}, {}, {}};
  const std::vector<std::size_t> trials = trials_of_rows(dataset, out.full);
  const auto add = [&](const char* name, const auto& row, const char* why = not_recorded) {
    add_probe(out, name, rows_of(trials, row), why);
  };
  add("phase S", [&](std::size_t i) { return rest_figures(dataset.trials[i]); });
  add(
      "pad pattern", [&](std::size_t i) { return pad_pattern(dataset.trials[i]); },
      "one taxel, or taxels without a level");
  add("durations", [&](std::size_t i) { return durations(dataset.trials[i], dataset.records[i]); });
  add_probe(out, "order and time", order_and_time(dataset, trials));
  add("lost frames", [&](std::size_t i) { return lost_frames(dataset.records[i]); });
  add("force error", [&](std::size_t i) { return force_error(dataset.records[i]); });
  add_columns(list_group_columns(dataset), trials, out);
  if (auto ok = add_changed(chosen, trials, out); !ok) return pass(ok.error());
  return out;
}

Result<AuditTables> imprint_tables(const ChosenTrials& chosen) {
  const auto imprints = extract_imprints(chosen.dataset);
  if (!imprints) return pass(imprints.error());
  AuditTables out{"imprints", chosen.features, {}, {}, {}, {}};
  Rows level;
  for (const auto& one : *imprints) level.push_back({classifier::compute_mean(one.image.data())});
  add_probe(out, "level", level);
  if (chosen.dataset.info.source == "campaign")
    add_probe(out, "order and time",
              order_and_time(chosen.dataset, trials_of_rows(chosen.dataset, out.full)));
  if (!chosen.dataset.info.group_columns.empty())
    add_columns(list_group_columns(chosen.dataset), trials_of_rows(chosen.dataset, out.full), out);
  return out;
}

Result<AuditTables> recording_tables(const RecordingSet& set, double window_s) {
  auto full = recording_features(set.recordings, window_s);
  if (!full) return pass(full.error());
  AuditTables out{"recordings", std::move(*full), {}, {}, {}, {}};
  std::map<std::string_view, std::size_t> place;
  for (std::size_t i = 0; i < set.recordings.size(); ++i) place[set.recordings[i].file] = i;
  std::vector<std::size_t> of_row;
  Rows level, duration;
  std::vector<classifier::vibro::Recording> scaled;
  for (const std::string& file : out.full.files) {
    of_row.push_back(place.at(file));
    auto& copy = scaled.emplace_back(set.recordings[of_row.back()]);
    level.emplace_back();
    for (auto& samples : copy.samples) {
      const double own = rms(samples);
      level.back().push_back(own);
      if (own > 0.0)
        for (double& x : samples) x /= own;
    }
    duration.push_back({copy.duration_s()});
  }
  add_probe(out, "level", level);
  add_probe(out, "durations", duration);
  out.absent.emplace_back("order and time", not_recorded);
  add_columns(list_group_columns(set), of_row, out);
  auto without = recording_features(scaled, window_s);
  if (!without) return pass(without.error(), "without level");
  out.changed.push_back({"without level", std::move(*without)});
  return out;
}

void add_group_probe(AuditTables& tables) {
  add_probe(tables, "group", indicators(tables.full.groups), "almost every row has its own group");
}

void add_column_probes(AuditTables& tables) {
  for (const AuditColumn& column : tables.columns)
    if (!column.of_cloth && column.of_row != tables.full.groups)
      add_probe(tables, std::string(column_probe) + column.name, indicators(column.of_row),
                "almost every row has its own value");
}

}  // namespace weft::daemon::cli
