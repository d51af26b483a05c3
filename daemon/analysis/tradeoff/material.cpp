#include "daemon/analysis/tradeoff/material.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <tuple>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

using classifier::FeatureMatrix;
using classifier::Trial;

/// For each row, the indices of its trials in the data set: one per exploration.
using Rows = std::vector<std::vector<std::size_t>>;
using RowKey = std::tuple<std::string, std::string, std::uint32_t>;  // label, group, repetition

std::vector<std::size_t> select_complete(const Dataset& dataset, const std::string& exploration) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    if (dataset.records[i].outcome == TrialOutcome::complete &&
        dataset.records[i].spec.exploration == exploration)
      out.push_back(i);
  return out;
}

Result<Rows> rows_of(const Dataset& dataset, const std::vector<std::string>& parts) {
  Rows out;
  std::map<RowKey, std::vector<std::size_t>> joined_rows;
  for (const std::string& part : parts) {
    const auto trials = select_complete(dataset, part);
    if (trials.empty())
      return fail({.code = Errc::not_found,
                   .where = dataset.info.name,
                   .what = "exploration without complete trials",
                   .expected = joined(list_explorations(dataset)),
                   .got = part});
    std::map<RowKey, std::size_t> last;
    for (const std::size_t i : trials) {
      if (parts.size() == 1) out.push_back({i});
      last[{dataset.trials[i].label, dataset.trials[i].group, dataset.records[i].spec.repetition}] =
          i;
    }
    for (const auto& [key, i] : last) joined_rows[key].push_back(i);
  }
  if (parts.size() == 1) return out;
  for (auto& [key, row] : joined_rows)
    if (row.size() == parts.size()) out.push_back(std::move(row));
  if (out.empty())
    return fail({.code = Errc::not_found,
                 .where = dataset.info.name,
                 .what = "no repetition with a trial of each exploration",
                 .got = joined(parts, "+")});
  return out;
}

Trial cut(const Trial& trial, std::size_t most_samples) {
  return most_samples == 0 ? trial : shortened(trial, most_samples);
}

Status extract(const Dataset& dataset, const MaterialOptions& options,
               const std::vector<std::string>& parts, Material& out) {
  for (std::size_t p = 0; p < parts.size(); ++p) {
    std::vector<Trial> trials;
    for (const auto& row : out.trials)
      trials.push_back(cut(dataset.trials[row[p]], out.most_samples));
    const auto part = classifier::build_feature_matrix(trials, options.features, options.threads);
    if (!part) return pass(part.error());
    append_columns(*part, parts.size() == 1 ? "" : parts[p] + ":", out.features);
  }
  return {};
}

void add_slide(const Dataset& dataset, const std::vector<std::size_t>& row, Material& out) {
  double row_s = 0;
  for (const std::size_t i : row) {
    const std::size_t all = dataset.trials[i].motion_samples();
    const std::size_t used = out.most_samples == 0 ? all : std::min(all, out.most_samples);
    const double slide_s = static_cast<double>(used) / dataset.info.taxel_rate_hz;
    row_s += slide_s;
    out.longest_slide_s = std::max(out.longest_slide_s, slide_s);
  }
  out.slide_s.push_back(row_s);
}

}  // namespace

Result<Material> prepare(const Dataset& dataset, const MaterialOptions& options) {
  if (!(dataset.info.taxel_rate_hz > 0))
    return fail({.code = Errc::invalid_argument,
                 .where = dataset.info.name,
                 .what = "sample rate not known"});
  const auto sum = explorations_in(options.exploration);
  if (!sum) return pass(sum.error());
  const std::vector<std::string>& parts = *sum;
  auto rows = rows_of(dataset, parts);
  if (!rows) return pass(rows.error());
  Material out;
  out.trials = std::move(*rows);
  const double samples = std::nearbyint(options.slide_s * dataset.info.taxel_rate_hz);
  if (options.slide_s > 0)
    out.most_samples = std::max<std::size_t>(1, static_cast<std::size_t>(samples));
  if (Status ok = extract(dataset, options, parts, out); !ok) return pass(ok.error());
  for (const auto& row : out.trials) {
    add_slide(dataset, row, out);
    out.speed_mm_s.push_back(speed_in_name(dataset.trials[row.front()].file));
  }
  return out;
}

std::vector<AnswerTrials> some_trials(const Dataset& dataset, const Material& material,
                                      const std::vector<std::size_t>& rows, std::size_t count) {
  std::vector<AnswerTrials> out;
  count = std::min(count, rows.size());
  for (std::size_t k = 0; k < count; ++k) {
    AnswerTrials trials;
    for (const std::size_t i : material.trials[rows[k * rows.size() / count]])
      trials.push_back(cut(dataset.trials[i], material.most_samples));
    out.push_back(std::move(trials));
  }
  return out;
}

Trial shortened(const Trial& trial, std::size_t samples) {
  Trial out{trial.file, trial.label, trial.group, trial.taxels, {}, {}};
  std::size_t moved = 0;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    if (trial.phase[i] == Phase::motion && ++moved > samples) continue;
    const auto row = trial.row(i);
    out.phase.push_back(trial.phase[i]);
    out.counts.insert(out.counts.end(), row.begin(), row.end());
  }
  return out;
}

std::optional<double> speed_in_name(const std::string& file) {
  const std::size_t end = file.rfind("mmps_");
  const std::size_t from = file.rfind("_V", end);
  if (end == std::string::npos || from == std::string::npos) return std::nullopt;
  const char* first = file.data() + from + 2;
  const char* const last = file.data() + end;
  if (first != last && *first == '-') ++first;
  double speed = 0;
  const auto [read_to, error] = std::from_chars(first, last, speed);
  if (error != std::errc{} || read_to != last || !(speed > 0) || !std::isfinite(speed))
    return std::nullopt;
  return speed;
}

}  // namespace weft::daemon
