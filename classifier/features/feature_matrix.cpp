#include "classifier/features/feature_matrix.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "classifier/base/parallel.hpp"

namespace weft::classifier {
namespace {

std::string describe(std::size_t taxels, PhaseSet phases) {
  return std::to_string(taxels) + " taxels, phases " + (phases.rest ? "S" : "") +
         (phases.press ? "P" : "") + "M" + (phases.end ? "E" : "");
}

Status check_alike(std::span<const Trial> trials) {
  const PhaseSet phases = phases_of(trials.front());
  for (const Trial& trial : trials) {
    if (trial.taxels == trials.front().taxels && phases_of(trial) == phases) continue;
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "taxels or phases differ from the first trial",
                 .expected = describe(trials.front().taxels, phases),
                 .got = describe(trial.taxels, phases_of(trial)),
                 .hint = "Use trials with the same taxels and phases"});
  }
  return {};
}

Status check_sizes(const FeatureMatrix& m) {
  if (m.values.cols() != m.names.size()) {
    return fail({.code = Errc::invalid_argument,
                 .where = "feature matrix",
                 .what = "numbers of names and columns differ",
                 .expected = std::to_string(m.names.size()) + " columns",
                 .got = std::to_string(m.values.cols())});
  }
  const std::size_t rows = m.values.rows();
  if (!m.parts.empty() && m.parts.size() != rows)
    return fail({.code = Errc::invalid_argument,
                 .where = "feature matrix",
                 .what = "number of parts differs from the rows",
                 .expected = std::to_string(rows) + " or 0",
                 .got = std::to_string(m.parts.size())});
  if (m.labels.size() != rows || m.groups.size() != rows || m.files.size() != rows) {
    return fail({.code = Errc::invalid_argument,
                 .where = "feature matrix",
                 .what = "numbers of labels, groups and files differ from the rows",
                 .expected = std::to_string(rows) + " of each",
                 .got = std::to_string(m.labels.size()) + ", " + std::to_string(m.groups.size()) +
                        ", " + std::to_string(m.files.size())});
  }
  return {};
}

Status check(const Trial& trial) {
  if (trial.taxels == 0)
    return fail(
        {.code = Errc::invalid_argument, .where = trial.file, .what = "no taxels recorded"});
  if (trial.counts.size() != trial.samples() * trial.taxels) {
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "number of values differs from the phases",
                 .expected = std::to_string(trial.samples() * trial.taxels) + " values",
                 .got = std::to_string(trial.counts.size())});
  }
  const auto motion = std::count(trial.phase.begin(), trial.phase.end(), Phase::motion);
  if (auto ok = check_motion_frames(static_cast<std::size_t>(motion), trial.taxels); !ok)
    return pass(ok.error(), trial.file);
  const std::size_t bad = first_not_finite(trial.counts);
  if (bad == trial.counts.size()) return {};
  return fail({.code = Errc::invalid_argument,
               .where = trial.file + ": sample " + std::to_string(bad / trial.taxels) + ", taxel " +
                        std::to_string(bad % trial.taxels + 1),
               .what = "sample not finite",
               .expected = "a finite number",
               .got = std::to_string(trial.counts[bad]),
               .hint = "Repair or remove the recording"});
}

}  // namespace

Status check_feature(double value, const std::string& where) {
  if (std::abs(value) <= largest_feature) return {};
  if (!std::isfinite(value)) return not_finite(where, "feature", value);
  return fail({.code = Errc::invalid_argument,
               .where = where,
               .what = "feature too large",
               .expected = "magnitude up to 2.2e307"});
}

Status check_length(std::span<const double> values, std::size_t expected, std::string_view where,
                    std::string_view hint) {
  if (values.size() == expected) return {};
  return fail({.code = Errc::invalid_argument,
               .where = std::string(where),
               .what = "wrong number of features",
               .expected = std::to_string(expected),
               .got = std::to_string(values.size()),
               .hint = std::string(hint)});
}

Status check_features(std::span<const double> values, std::span<const std::string> names) {
  for (std::size_t k = 0; k < values.size(); ++k)
    if (!(std::abs(values[k]) <= largest_feature)) return check_feature(values[k], names[k]);
  return {};
}

Status check(const FeatureMatrix& matrix) {
  if (auto ok = check_sizes(matrix); !ok) return ok;
  for (std::size_t r = 0; r < matrix.size(); ++r)
    for (std::size_t k = 0; k < matrix.names.size(); ++k)
      if (!(std::abs(matrix.values(r, k)) <= largest_feature))
        return check_feature(matrix.values(r, k), matrix.files[r] + ": " + matrix.names[k]);
  return {};
}

Result<FeatureMatrix> build_feature_matrix(std::span<const Trial> trials,
                                           const FeatureOptions& options, std::size_t threads) {
  if (trials.empty())
    return fail({.code = Errc::invalid_argument, .where = "data set", .what = "no trials"});
  if (auto ok = check_alike(trials); !ok) return pass(ok.error());
  FeatureMatrix out;
  out.names = FeatureLayout(trials.front().taxels, phases_of(trials.front())).names();
  out.values = Matrix(trials.size(), out.names.size());
  std::vector<Status> done(trials.size());
  parallel_blocks(trials.size(), threads, [&](std::size_t from, std::size_t to) {
    FeatureExtractor extractor(options);
    for (std::size_t i = from; i < to; ++i) {
      const auto row = extractor.extract(trials[i]);
      if (row) {
        std::copy(row->begin(), row->end(), out.values.row(i).begin());
      } else {
        done[i] = pass(row.error());
      }
    }
  });
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (!done[i]) return pass(done[i].error());
    out.labels.push_back(trials[i].label);
    out.groups.push_back(trials[i].group);
    out.files.push_back(trials[i].file);
  }
  return out;
}

std::size_t find_place(std::span<const std::string> sorted, const std::string& label) {
  return static_cast<std::size_t>(std::ranges::lower_bound(sorted, label) - sorted.begin());
}

void append_columns(const FeatureMatrix& part, const std::string& prefix, FeatureMatrix& whole) {
  Matrix wide(part.size(), whole.names.size() + part.names.size());
  for (std::size_t r = 0; r < part.size(); ++r) {
    if (!whole.names.empty()) std::ranges::copy(whole.values.row(r), wide.row(r).begin());
    std::ranges::copy(part.values.row(r), wide.row(r).last(part.names.size()).begin());
  }
  for (const std::string& name : part.names) whole.names.push_back(prefix + name);
  whole.values = std::move(wide);
  whole.labels = part.labels;
  whole.groups = part.groups;
  whole.files = part.files;
}

FeatureMatrix select_columns(const FeatureMatrix& matrix, std::span<const std::size_t> columns) {
  FeatureMatrix out;
  out.values = Matrix(matrix.size(), columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k) {
    out.names.push_back(matrix.names[columns[k]]);
    for (std::size_t r = 0; r < matrix.size(); ++r) out.values(r, k) = matrix.values(r, columns[k]);
  }
  out.labels = matrix.labels;
  out.groups = matrix.groups;
  out.files = matrix.files;
  out.parts = matrix.parts;
  return out;
}

FeatureMatrix select_rows(const FeatureMatrix& matrix, std::span<const std::size_t> rows) {
  FeatureMatrix out;
  out.names = matrix.names;
  out.values = matrix.values.take(rows);
  for (const std::size_t r : rows) {
    out.labels.push_back(matrix.labels[r]);
    out.groups.push_back(matrix.groups[r]);
    out.files.push_back(matrix.files[r]);
    if (!matrix.parts.empty()) out.parts.push_back(matrix.parts[r]);
  }
  return out;
}

Result<std::span<const double>> FeatureExtractor::extract(const Trial& trial) {
  if (auto ok = check(trial); !ok) return pass(ok.error());
  if (!stream_ || stream_->taxels() != trial.taxels) stream_.emplace(trial.taxels, options_);
  stream_->restart();
  // Frames of a phase follow each other: add each such run at once.
  for (std::size_t from = 0, to = 0; from < trial.samples(); from = to) {
    while (to < trial.samples() && trial.phase[to] == trial.phase[from]) ++to;
    stream_->add_checked(
        trial.phase[from],
        std::span(trial.counts).subspan(from * trial.taxels, (to - from) * trial.taxels));
  }
  auto features = stream_->features(wanted_);
  if (!features) return pass(features.error(), trial.file);
  return features;
}

Result<std::vector<double>> extract(const Trial& trial, const FeatureOptions& options) {
  FeatureExtractor extractor(options);
  const auto features = extractor.extract(trial);
  if (!features) return pass(features.error());
  return std::vector<double>(features->begin(), features->end());
}

}  // namespace weft::classifier
