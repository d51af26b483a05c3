#pragma once
// A table of samples, a line each, as one trial.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/base/text/csv_table.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

// A list of recordings: which file holds what.

struct ManifestEntry {
  std::string file;            ///< as written
  std::filesystem::path path;  ///< relative to the manifest's folder
  std::string label;
  std::string group;  ///< empty where the manifest has no such column
  TrialPlace place;   ///< likewise 0
  /// Of which recording the file is a part; empty: it is one by itself.
  std::string recording;
  std::vector<std::string> group_values;  ///< in the order of Manifest::group_columns
  std::string where;                      ///< manifest:line
};

/// What a manifest may tell beside `file,label[,group][,bench]`.
enum class ManifestKind {
  files,      ///< nothing
  trials,     ///< `[,piece][,mounting][,patch]`
  recordings  ///< `[,recording]`
};

struct Manifest {
  std::vector<ManifestEntry> entries;
  BenchKind bench = BenchKind::unknown;    ///< that recorded all of them
  std::vector<std::string> group_columns;  ///< all others, in byte order
};

/// A CSV with columns `file,label[,group][,bench]` and those of its kind in any order (quoted
/// fields allowed), and others, by which its rows can be grouped. A name that could be taken for
/// another column's, an empty file or label, a count that is none, several benches, a file listed
/// twice (under whatever name: `./a.csv`, a link) and a list without files are refused with
/// file:line. `bench`: as stated by other means, with which the column must agree.
Result<Manifest> read_manifest(const std::filesystem::path& path,
                               ManifestKind kind = ManifestKind::files,
                               std::optional<BenchKind> bench = {});

/// Which columns of a file hold what.
struct TrialColumns {
  std::size_t time = 0;
  double ns_per_time_unit = 1e9;
  std::optional<std::size_t> phase;   ///< nothing: all samples are phase M
  std::vector<std::size_t> channels;  ///< in the order of the taxels
  bool is_rate_stated = false;
};

/// Reads all lines that are left. Times must not run backwards. Refuses a file without samples, and
/// what RepeatedSamples refuses.
Status read_samples(CsvTable& csv, const TrialColumns& columns, classifier::Trial& trial,
                    TrialRecord& record, std::vector<Warning>& warnings);

/// Counts the samples that have the time and all values of the one before. The rate of their times
/// is not the sensor's.
class RepeatedSamples {
 public:
  /// The sample of the table's current line.
  void add(const CsvTable& csv, bool is_repeated);
  /// Refuses more than one in a hundred where no rate is stated, by the first one's line. Others
  /// are a warning.
  Status check(bool is_rate_stated, std::vector<Warning>& warnings) const;

 private:
  std::size_t samples_ = 0, repeated_ = 0;
  std::string first_;
};

/// Of a rate that is below what is usual of such data, 0 where it is not known.
void warn_of_slow_rate(double rate_hz, double usual_hz, std::vector<Warning>& warnings);

/// The sample rate that the phases M of all trials have in common, as common_period_s() tells it; 0
/// when their times do not tell.
double common_rate_hz(const Dataset& dataset);
/// Puts the rate into the set: `stated_hz`, or with 0 common_rate_hz().
/// Errors: parse, where none is stated and the times of a trial are not regular.
Status settle_rate(Dataset& dataset, double stated_hz);

/// An imported set without trials, with the version of this program.
Dataset imported_set(std::string name, std::string source, BenchKind kind = BenchKind::unknown);

/// Adds a trial to a set whose trials must all have as many taxels as the first.
Status append(Dataset& dataset, classifier::Trial trial, TrialRecord record);

}  // namespace weft::daemon
