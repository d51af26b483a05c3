#pragma once
// Other people's recordings into a Dataset, and features out as text.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/dataset/dataset.hpp"

namespace weft::daemon {

/// Reads a manifest with columns `file,label[,group]` in any order (quoted fields allowed) and each
/// trial file it names, relative to the manifest: `t_s,[phase,]ch1..chN`, no phase column means all
/// M. Errors carry file:line. Bench kind of the result: unknown.
Result<Dataset> import_manifest(const std::filesystem::path& manifest);

/// Reads every `<Fabric>_F<grip>_V[-]<speed>mmps_<repetition>.csv` in `folder` whose name matches
/// `filter` (shell wildcards * and ?). Label = fabric, group = repetition, all phase M, 16 taxels.
Result<Dataset> import_fabricslide(const std::filesystem::path& folder,
                                   std::string_view filter = "*");

/// One row of a feature table.
struct FeatureRow {
  std::string file;
  std::string label;
  std::string group;
  std::vector<double> values;  ///< NaN where the trial has no such phase: written as an empty field
};

/// Writes `file,label,group,<names>`, 17 significant digits; temporary name, renamed on success.
Status export_features_csv(const std::filesystem::path& path, std::span<const std::string> names,
                           std::span<const FeatureRow> rows);

}  // namespace weft::daemon
