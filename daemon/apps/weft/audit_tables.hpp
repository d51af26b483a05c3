#pragma once
// The tables that `weft audit` compares, from a data set: full features, probes, and features
// without level or pad pattern. Rows are whole trials, recordings or imprints.

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "classifier/evaluate/audit.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/storage/recordings/recording_set.hpp"

namespace weft::daemon::cli {

/// A column of the data set that groups its rows.
struct GroupColumn {
  std::string name;                 ///< "mounting" or "piece", counted within a label
  std::vector<std::string> of_row;  ///< one value only: nothing is left out by it
  bool whole = false;               ///< in every split; see note_whole_columns()
};

/// Sets GroupColumn::whole: no split has rows of one mounting (piece) on both sides.
void note_whole_columns(std::vector<GroupColumn>& columns, const classifier::FeatureMatrix& full,
                        std::span<const classifier::Split> splits);

struct AuditTables {
  std::string rows;  ///< what a row is: "trials", "recordings", "imprints"
  classifier::FeatureMatrix full;
  std::vector<classifier::Probe> probes;
  std::vector<std::pair<std::string, std::string>> absent;  ///< probe, and why it is not there
  std::vector<classifier::Probe> changed;  ///< full features without level, without pattern
  std::vector<GroupColumn> columns;        ///< that the data set names
};

/// Scales every pad so that its mean of phase M is that of all pads. A pad whose mean is not
/// positive stays as it is.
void remove_pad_pattern(classifier::Trial& trial);

/// Of `chosen`, whole slides of one exploration. Errors: those of build_feature_matrix().
Result<AuditTables> slide_tables(const ChosenTrials& chosen);
/// Errors: those of extract_imprints().
Result<AuditTables> imprint_tables(const ChosenTrials& chosen);
/// A row for each recording: the mean of the default features over its windows of `window_s`, one
/// after another; shorter recordings are left out. Errors: those of cut_and_extract().
Result<AuditTables> recording_tables(const RecordingSet& set, double window_s);

/// Adds which group a row is in as a probe, for splits that do not keep groups whole.
void add_group_probe(AuditTables& tables);

}  // namespace weft::daemon::cli
