#include "daemon/storage/dataset/trial_csv.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>

#include "daemon/base/text/format.hpp"
#include "daemon/base/text/similar_names.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/dataset/sample_times.hpp"

namespace weft::daemon {
namespace {

Result<Phase> read_phase(const CsvTable& csv, const TrialColumns& columns) {
  if (!columns.phase) return Phase::motion;
  const std::string& word = csv.fields()[*columns.phase];
  const auto phase = word.size() == 1 ? phase_from_char(word.front()) : std::nullopt;
  if (!phase)
    return csv.complaint("unknown phase", "S, P, M, E or -", "'" + word.substr(0, 9) + "'");
  return *phase;
}

Result<std::int64_t> read_time(const CsvTable& csv, const TrialColumns& columns) {
  const auto time = csv.time(columns.time, columns.ns_per_time_unit);
  if (!time) return pass(time.error());
  return std::llround(*time * columns.ns_per_time_unit);
}

struct ManifestColumns {
  std::size_t file = 0;
  std::size_t label = 0;
  std::optional<std::size_t> group;
  std::optional<std::size_t> piece, mounting, patch;
  std::optional<std::size_t> recording = {}, bench = {};
  std::vector<std::size_t> rest = {};  // sorted by name
};

/// Checks the name of a column that is not a standard one; rows can be grouped by it.
Status check_group_name(const CsvTable& manifest, const std::string& name,
                        const std::vector<std::string_view>& standard) {
  // Names with another meaning in --group or in the file.
  constexpr std::array taken{"recorded", "exploration", "recording", "outcome"};
  if (is_invisible(name))
    return manifest.complaint("column without a name", "a name for every column", {},
                              "Name the column or remove it");
  if (!is_utf8(name)) return manifest.complaint("column name not UTF-8", "UTF-8 text");
  const std::string plain = lower_case(trimmed(name));
  if (std::ranges::find(standard, plain) != standard.end())
    return manifest.complaint("ambiguous column name", joined(standard),
                              "'" + shortened(name) + "'", "Did you mean " + plain + "?");
  if (std::ranges::find(taken, plain) != taken.end())
    return manifest.complaint("reserved column name", "another name", "'" + shortened(name) + "'",
                              "Rename the column");
  return {};
}

Result<ManifestColumns> read_columns(CsvTable& manifest, ManifestKind kind) {
  const auto file = manifest.take_column("file");
  if (!file) return pass(file.error());
  const auto label = manifest.take_column("label");
  if (!label) return pass(label.error());
  ManifestColumns out{*file, *label, manifest.find_column("group"), {}, {}, {}};
  out.bench = manifest.find_column("bench");
  std::vector<std::string_view> known{"file", "label", "group", "bench"};
  if (kind == ManifestKind::recordings) {
    out.recording = manifest.find_column("recording");
    known.emplace_back("recording");
  }
  if (kind == ManifestKind::trials) {
    out.piece = manifest.find_column("piece");
    out.mounting = manifest.find_column("mounting");
    out.patch = manifest.find_column("patch");
    known.insert(known.end(), {"piece", "mounting", "patch"});
  }
  out.rest = manifest.take_rest();
  for (const std::size_t c : out.rest)
    if (auto ok = check_group_name(manifest, manifest.header()[c], known); !ok)
      return pass(ok.error());
  std::ranges::sort(out.rest, {}, [&](std::size_t c) { return manifest.header()[c]; });
  return out;
}

/// A number from 1; 0 if there is no such column.
Result<std::uint32_t> read_count(const CsvTable& manifest, std::optional<std::size_t> column) {
  if (!column) return 0U;
  const std::string& text = manifest.fields()[*column];
  std::uint32_t out = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc() || end != text.data() + text.size() || out == 0)
    return manifest.complaint("not a positive whole number", "1 or more", text.substr(0, 40));
  return out;
}

/// Reads the bench of the manifest's current line; `bench`: the bench of the earlier lines, or the
/// stated one.
Status read_bench(const CsvTable& manifest, std::optional<std::size_t> column,
                  std::optional<BenchKind>& bench) {
  if (!column) return {};
  const std::string& word = manifest.fields()[*column];
  const auto own = bench_kind_from(word);
  if (!own)
    return manifest.complaint("unknown bench kind", "real, simulated or unknown", shortened(word));
  if (bench && *own != *bench)
    return manifest.complaint("bench kind differs from earlier lines or --bench",
                              std::string(to_string(*bench)), word,
                              "Make one data set for each bench kind");
  bench = own;
  return {};
}

/// The canonical path of a file, with links resolved.
std::filesystem::path one_name(const std::filesystem::path& path) {
  std::error_code unseen;
  const auto canonical = std::filesystem::weakly_canonical(path, unseen);
  return unseen ? path.lexically_normal() : canonical;
}

/// Place of each file's entry, by one_name().
using SeenFiles = std::map<std::filesystem::path, std::string>;

/// Reads the manifest's current line.
Result<ManifestEntry> read_entry(const CsvTable& manifest, const ManifestColumns& columns,
                                 const std::filesystem::path& folder, SeenFiles& seen) {
  ManifestEntry out;
  out.file = manifest.fields()[columns.file];
  out.label = manifest.fields()[columns.label];
  if (columns.group) out.group = manifest.fields()[*columns.group];
  if (columns.recording) out.recording = manifest.fields()[*columns.recording];
  for (const std::size_t c : columns.rest) out.group_values.push_back(manifest.fields()[c]);
  const auto piece = read_count(manifest, columns.piece);
  const auto mounting = read_count(manifest, columns.mounting);
  const auto patch = read_count(manifest, columns.patch);
  for (const auto* count : {&piece, &mounting, &patch})
    if (!*count) return pass(count->error());
  out.place = {*piece, *mounting, *patch};
  if (is_invisible(out.file)) return manifest.complaint("file name empty");
  if (is_invisible(out.label)) return manifest.complaint("label empty");
  for (const std::string* name : {&out.file, &out.label, &out.group, &out.recording})
    if (!is_utf8(*name)) return manifest.complaint("name not UTF-8", "UTF-8 text");
  if (auto ok = check_group_values(out.group_values, columns.rest.size()); !ok)
    return pass(ok.error(), manifest.where());
  out.path = (folder / out.file).lexically_normal();
  out.where = manifest.where();
  std::error_code unseen;
  if (out.file.find('\\') != std::string::npos && !std::filesystem::exists(out.path, unseen))
    return fail({.code = Errc::not_found,
                 .where = out.where,
                 .what = "no such file",
                 .got = out.file,
                 .hint = "Give the path relative to the manifest, with / between folders"});
  const auto [first, is_new] =
      seen.emplace(one_name(out.path), out.where + " as '" + out.file + "'");
  if (is_new) return out;
  return fail({.code = Errc::parse,
               .where = out.where,
               .what = "file listed twice",
               .got = out.file,
               .hint = "Remove it here or in " + first->second});
}

}  // namespace

Status read_samples(CsvTable& csv, const TrialColumns& columns, classifier::Trial& trial,
                    TrialRecord& record, std::vector<Warning>& warnings) {
  trial.taxels = columns.channels.size();
  RepeatedSamples repeated;
  auto more = csv.next();
  for (; more && *more; more = csv.next()) {
    const auto t_ns = read_time(csv, columns);
    if (!t_ns) return pass(t_ns.error());
    if (!record.t_ns.empty() && *t_ns < record.t_ns.back()) return csv.complaint("time decreases");
    const auto phase = read_phase(csv, columns);
    if (!phase) return pass(phase.error());
    if (auto done = csv.append_numbers(columns.channels, trial.counts); !done) return done;
    record.t_ns.push_back(*t_ns);
    trial.phase.push_back(*phase);
    const std::size_t i = trial.samples() - 1;
    repeated.add(csv, i > 0 && record.t_ns[i - 1] == *t_ns && trial.phase[i - 1] == *phase &&
                          std::ranges::equal(trial.row(i - 1), trial.row(i)));
  }
  if (!more) return pass(std::move(more).error());
  if (trial.phase.empty()) return csv.complaint("no samples after the header");
  return repeated.check(columns.is_rate_stated, warnings);
}

void RepeatedSamples::add(const CsvTable& csv, bool is_repeated) {
  ++samples_;
  if (is_repeated && repeated_++ == 0) first_ = csv.where();
}

Status RepeatedSamples::check(bool is_rate_stated, std::vector<Warning>& warnings) const {
  constexpr std::size_t tolerated_share = 100;  // one in this number of samples may be a repetition
  if (repeated_ == 0) return {};
  const std::string count = std::to_string(repeated_) + " of " + std::to_string(samples_);
  if (!is_rate_stated && repeated_ > samples_ / tolerated_share)
    return fail({.code = Errc::parse,
                 .where = first_,
                 .what = "samples repeated with equal times and values",
                 .expected = "each sample once",
                 .got = count,
                 .hint = "Remove the copies, or state the rate of the sensor with --rate-hz"});
  warnings.push_back({"repeated_samples", first_ + ": " + count +
                                              " samples repeat the time and values of the "
                                              "sample before"});
  return {};
}

double common_rate_hz(const Dataset& dataset) {
  std::vector<std::vector<std::int64_t>> times;
  for (std::size_t i = 0; i < dataset.records.size(); ++i)
    times.push_back(motion_times(dataset, i));
  const double period_s = common_period_s(times);
  return period_s > 0 ? 1 / period_s : 0;
}

Status settle_rate(Dataset& dataset, double stated_hz) {
  for (std::size_t i = 0; stated_hz == 0 && i < dataset.records.size(); ++i)
    if (const auto times = motion_times(dataset, i);
        times.size() > 1 && sampled_time(times).intervals == 0)
      return fail({.code = Errc::parse,
                   .where = dataset.trials[i].file,
                   .what = "samples not evenly spaced",
                   .expected = "intervals within 1 % of each other, pauses left out",
                   .hint = "State the rate of the sensor with --rate-hz"});
  dataset.info.taxel_rate_hz = stated_hz == 0 ? common_rate_hz(dataset) : stated_hz;
  if (stated_hz == 0) warn_of_slow_rate(dataset.info.taxel_rate_hz, 1.5, dataset.warnings);
  return {};
}

void warn_of_slow_rate(double rate_hz, double usual_hz, std::vector<Warning>& warnings) {
  if (rate_hz <= 0 || rate_hz >= usual_hz) return;
  warnings.push_back({"slow_rate", "the times give a low rate of " + general(rate_hz) +
                                       " Hz: check that t_s is in seconds"});
}

Dataset imported_set(std::string name, std::string source, BenchKind kind) {
  Dataset out;
  out.info.kind = kind;
  out.info.name = std::move(name);
  out.info.source = std::move(source);
  out.info.software_version = software_version();
  return out;
}

Status append(Dataset& dataset, classifier::Trial trial, TrialRecord record) {
  if (!dataset.trials.empty() && dataset.trials.front().taxels != trial.taxels)
    return fail({.code = Errc::parse,
                 .where = trial.file,
                 .what = "number of channels differs from " + dataset.trials.front().file,
                 .expected = std::to_string(dataset.trials.front().taxels),
                 .got = std::to_string(trial.taxels)});
  record.spec.index = static_cast<std::uint32_t>(dataset.trials.size());
  record.spec.label = trial.label;
  record.spec.group = trial.group;
  dataset.trials.push_back(std::move(trial));
  dataset.records.push_back(std::move(record));
  return {};
}

Result<Manifest> read_manifest(const std::filesystem::path& path, ManifestKind kind,
                               std::optional<BenchKind> bench) {
  auto manifest = CsvTable::open(path);
  if (!manifest) return pass(std::move(manifest).error());
  const auto columns = read_columns(*manifest, kind);
  if (!columns) return pass(columns.error());
  Manifest out;
  for (const std::size_t c : columns->rest) out.group_columns.push_back(manifest->header()[c]);
  SeenFiles seen;
  auto more = manifest->next();
  for (; more && *more; more = manifest->next()) {
    auto entry = read_entry(*manifest, *columns, path.parent_path(), seen);
    if (!entry) return pass(std::move(entry).error());
    if (auto ok = read_bench(*manifest, columns->bench, bench); !ok) return pass(ok.error());
    out.entries.push_back(std::move(*entry));
  }
  if (!more) return pass(std::move(more).error());
  if (out.entries.empty()) return manifest->complaint("no trials after the header");
  out.bench = bench.value_or(BenchKind::unknown);
  return out;
}

}  // namespace weft::daemon
