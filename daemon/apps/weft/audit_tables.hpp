#pragma once
// The tables that `weft audit` compares, from a data set: full features, probes, and features
// without level or taxel pattern. Rows are complete trials, recordings or imprints.

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "classifier/evaluate/audit.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/storage/recordings/recording_set.hpp"

namespace weft::daemon::cli {

/// A column of the data set that groups its rows.
struct AuditColumn {
  std::string name;                 ///< "mounting" or "piece", counted within a label, or another
  std::vector<std::string> of_row;  ///< with a single value, no rows can be left out by it
  bool whole = false;               ///< in every split; see note_whole_columns()
  bool of_cloth = true;             ///< mounting, piece: belongs to one label
};

/// Sets AuditColumn::whole: no split has rows of one mounting (piece) on both sides.
void note_whole_columns(std::vector<AuditColumn>& columns, const classifier::FeatureMatrix& full,
                        std::span<const classifier::Split> splits);

struct AuditTables {
  std::string rows;  ///< kind of the rows: "trials", "recordings", "imprints"
  classifier::FeatureMatrix full;
  std::vector<classifier::Probe> probes;
  std::vector<std::pair<std::string, std::string>>
      absent;                              ///< probe, and the reason for its absence
  std::vector<classifier::Probe> changed;  ///< full features without level, without pattern
  std::vector<AuditColumn> columns;        ///< columns that the data set names
};

/// Scales every taxel so that its mean in phase M is the mean of all taxels. A taxel with a mean
/// that is not positive stays unchanged.
void remove_pad_pattern(classifier::Trial& trial);

/// Tables of the complete slides of one exploration in `chosen`. Errors: those of
/// build_feature_matrix().
Result<AuditTables> slide_tables(const ChosenTrials& chosen);
/// Errors: those of extract_imprints().
Result<AuditTables> imprint_tables(const ChosenTrials& chosen);
/// One row per recording: the mean of the default features over its consecutive windows of
/// `window_s`. Shorter recordings are left out. Errors: those of cut_and_extract().
Result<AuditTables> recording_tables(const RecordingSet& set, double window_s);

/// The trial of each row, by its file.
std::vector<std::size_t> trials_of_rows(const Dataset& dataset,
                                        const classifier::FeatureMatrix& rows);

/// Adds the group of each row as a probe, for splits that do not keep groups whole.
void add_group_probe(AuditTables& tables);
/// Adds each column that does not belong to the fabric as a probe: `column session`.
void add_column_probes(AuditTables& tables);
inline constexpr std::string_view column_probe = "column ";

}  // namespace weft::daemon::cli
