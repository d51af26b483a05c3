#pragma once
// A table of samples, a line each, as one trial.

#include <optional>
#include <vector>

#include "daemon/base/text/csv.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Which columns of a file hold what.
struct TrialColumns {
  std::size_t time = 0;
  double ns_per_time_unit = 1e9;
  std::optional<std::size_t> phase;   ///< nothing: all samples are phase M
  std::vector<std::size_t> channels;  ///< in the order of the taxels
};

/// Reads all lines that are left. Times must not run backwards. Refuses a file without samples.
Status read_samples(CsvReader& csv, const TrialColumns& columns, classifier::Trial& trial,
                    TrialRecord& record);

/// Columns named `prefix`1 to `prefix`N, each once; fills `channels`. `taken` marks columns that
/// are accounted for; any other is an error.
Status find_channels(const CsvReader& csv, std::string_view prefix, std::vector<bool>& taken,
                     std::vector<std::size_t>& channels);
std::optional<std::size_t> find_column(const CsvReader& csv, std::string_view name);

/// The sample rate that the phases M of all trials have in common, as common_period_s() tells it; 0
/// when their times do not tell.
double common_rate_hz(const Dataset& dataset);

/// Adds a trial to a set whose trials must all have as many taxels as the first.
Status append(Dataset& dataset, classifier::Trial trial, TrialRecord record);

}  // namespace weft::daemon
