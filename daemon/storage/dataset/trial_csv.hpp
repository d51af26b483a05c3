#pragma once
// Reads a table of samples, one per line, as one trial.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/base/text/csv_table.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

// A manifest lists recordings: the file, label and group of each.

struct ManifestEntry {
  std::string file;            ///< as written
  std::filesystem::path path;  ///< relative to the manifest's folder
  std::string label;
  std::string group;  ///< empty if the manifest has no such column
  TrialPlace place;   ///< 0 if the manifest has no such columns
  /// Name of the recording that the file is a part of; empty: the file is a recording of its own.
  std::string recording;
  std::vector<std::string> group_values;  ///< in the order of Manifest::group_columns
  std::string where;                      ///< manifest:line
};

/// Optional columns of a manifest besides `file,label[,group][,bench]`.
enum class ManifestKind {
  files,      ///< none
  trials,     ///< `[,piece][,mounting][,patch]`
  recordings  ///< `[,recording]`
};

struct Manifest {
  std::vector<ManifestEntry> entries;
  BenchKind bench = BenchKind::unknown;    ///< the bench of all entries
  std::vector<std::string> group_columns;  ///< names of all other columns, in byte order
};

/// A CSV with columns `file,label[,group][,bench]` and those of its kind, in any order (quoted
/// fields allowed). Other columns can group its rows. Errors carry file:line. Refused are a name
/// that resembles another column's, an empty file or label, an invalid count, several benches, a
/// file listed twice (under any name: `./a.csv`, a link) and a list without files. `bench`: stated
/// otherwise; the column must agree with it.
Result<Manifest> read_manifest(const std::filesystem::path& path,
                               ManifestKind kind = ManifestKind::files,
                               std::optional<BenchKind> bench = {});

/// The columns of a file, by content.
struct TrialColumns {
  std::size_t time = 0;
  double ns_per_time_unit = 1e9;
  std::optional<std::size_t> phase;   ///< nothing: all samples are phase M
  std::vector<std::size_t> channels;  ///< in the order of the taxels
  bool is_rate_stated = false;
};

/// Reads all remaining lines. Times must not decrease. Refuses a file without samples, and
/// everything that RepeatedSamples refuses.
Status read_samples(CsvTable& csv, const TrialColumns& columns, classifier::Trial& trial,
                    TrialRecord& record, std::vector<Warning>& warnings);

/// Counts samples that repeat the time and all values of the previous one. The rate of such times
/// is not the sensor's.
class RepeatedSamples {
 public:
  /// Adds the sample of the table's current line.
  void add(const CsvTable& csv, bool is_repeated);
  /// Refuses more than one repeated sample in a hundred if no rate is stated, with the line of the
  /// first. Others give a warning.
  Status check(bool is_rate_stated, std::vector<Warning>& warnings) const;

 private:
  std::size_t samples_ = 0, repeated_ = 0;
  std::string first_;
};

/// Warns of a rate below the usual one for such data; a rate of 0 is not known.
void warn_of_slow_rate(double rate_hz, double usual_hz, std::vector<Warning>& warnings);

/// The common sample rate of the phases M of all trials, see common_period_s(); 0 if the times do
/// not determine it.
double common_rate_hz(const Dataset& dataset);
/// Sets the rate of the data set: `stated_hz`, or common_rate_hz() if that is 0. Errors: parse if
/// no rate is stated and the times of a trial are not regular.
Status settle_rate(Dataset& dataset, double stated_hz);

/// An empty imported set with the version of this program.
Dataset imported_set(std::string name, std::string source, BenchKind kind = BenchKind::unknown);

/// Adds a trial; all trials must have the same number of taxels.
Status append(Dataset& dataset, classifier::Trial trial, TrialRecord record);

}  // namespace weft::daemon
