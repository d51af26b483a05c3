#include "daemon/storage/dataset/trial_csv.hpp"

#include <charconv>
#include <cmath>

#include "daemon/storage/dataset/sample_times.hpp"

namespace weft::daemon {
namespace {

/// `ch12` with prefix `ch` gives 12; nothing for anything else, `ch012` included.
std::optional<std::size_t> channel_number(std::string_view name, std::string_view prefix) {
  if (!name.starts_with(prefix)) return std::nullopt;
  name.remove_prefix(prefix.size());
  std::size_t number = 0;
  const char* end = name.data() + name.size();
  const auto [stopped, error] = std::from_chars(name.data(), end, number);
  if (error != std::errc() || stopped != end || number == 0 || name.front() == '0')
    return std::nullopt;
  return number;
}

Result<Phase> read_phase(const CsvReader& csv, const TrialColumns& columns) {
  if (!columns.phase) return Phase::motion;
  const std::string& word = csv.fields()[*columns.phase];
  const auto phase = word.size() == 1 ? phase_from_char(word.front()) : std::nullopt;
  if (!phase)
    return csv.complaint("unknown phase", "S, P, M, E or -", "'" + word.substr(0, 9) + "'");
  return *phase;
}

Result<std::int64_t> read_time(const CsvReader& csv, const TrialColumns& columns) {
  const auto time = csv.time(columns.time, columns.ns_per_time_unit);
  if (!time) return pass(time.error());
  return std::llround(*time * columns.ns_per_time_unit);
}

}  // namespace

Status read_samples(CsvReader& csv, const TrialColumns& columns, classifier::Trial& trial,
                    TrialRecord& record) {
  trial.taxels = columns.channels.size();
  auto more = csv.next();
  for (; more && *more; more = csv.next()) {
    const auto t_ns = read_time(csv, columns);
    if (!t_ns) return pass(t_ns.error());
    if (!record.t_ns.empty() && *t_ns < record.t_ns.back())
      return csv.complaint("time runs backwards");
    const auto phase = read_phase(csv, columns);
    if (!phase) return pass(phase.error());
    for (const std::size_t column : columns.channels) {
      const auto count = csv.number(column);
      if (!count) return pass(count.error());
      trial.counts.push_back(*count);
    }
    record.t_ns.push_back(*t_ns);
    trial.phase.push_back(*phase);
  }
  if (!more) return pass(std::move(more).error());
  if (trial.phase.empty()) return csv.complaint("a header but no samples");
  return {};
}

std::optional<std::size_t> find_column(const CsvReader& csv, std::string_view name) {
  for (std::size_t i = 0; i < csv.header().size(); ++i)
    if (csv.header()[i] == name) return i;
  return std::nullopt;
}

Status find_channels(const CsvReader& csv, std::string_view prefix, std::vector<bool>& taken,
                     std::vector<std::size_t>& channels) {
  std::size_t highest = 0;
  for (std::size_t i = 0; i < csv.header().size(); ++i) {
    if (taken[i]) continue;
    const auto number = channel_number(csv.header()[i], prefix);
    if (!number)
      return csv.complaint("unknown column '" + csv.header()[i].substr(0, 40) + "'",
                           std::string(prefix) + "1 to " + std::string(prefix) + "N");
    highest = std::max(highest, *number);
  }
  for (std::size_t k = 1; k <= std::max<std::size_t>(highest, 1); ++k) {
    const auto column = find_column(csv, std::string(prefix) + std::to_string(k));
    if (!column)
      return csv.complaint("the column " + std::string(prefix) + std::to_string(k) + " is missing");
    taken[*column] = true;
    channels.push_back(*column);
  }
  return {};
}

double common_rate_hz(const Dataset& dataset) {
  std::vector<std::vector<std::int64_t>> times;
  for (std::size_t i = 0; i < dataset.records.size(); ++i)
    times.push_back(motion_times(dataset, i));
  const double period_s = common_period_s(times);
  return period_s > 0 ? 1 / period_s : 0;
}

Status append(Dataset& dataset, classifier::Trial trial, TrialRecord record) {
  if (!dataset.trials.empty() && dataset.trials.front().taxels != trial.taxels)
    return fail({.code = Errc::parse,
                 .where = trial.file,
                 .what = "another number of channels than " + dataset.trials.front().file,
                 .expected = std::to_string(dataset.trials.front().taxels),
                 .got = std::to_string(trial.taxels)});
  record.spec.index = static_cast<std::uint32_t>(dataset.trials.size());
  record.spec.label = trial.label;
  record.spec.group = trial.group;
  dataset.trials.push_back(std::move(trial));
  dataset.records.push_back(std::move(record));
  return {};
}

}  // namespace weft::daemon
