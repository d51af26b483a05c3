#pragma once
// Other people's recordings into a Dataset, and features out as text.

#include <filesystem>
#include <string>
#include <string_view>

#include "classifier/features/feature_matrix.hpp"
#include "daemon/dataset/dataset.hpp"

namespace weft::daemon {

/// Reads a manifest with columns `file,label[,group]` in any order (quoted fields allowed) and each
/// trial file it names, relative to the manifest: `t_s,[phase,]ch1..chN`, no phase column means all
/// M. Errors carry file:line. Bench kind of the result: unknown.
Result<Dataset> import_manifest(const std::filesystem::path& manifest);

/// One such trial file by itself: a data set of one trial without label or group.
Result<Dataset> import_trial(const std::filesystem::path& path);
/// The same from text that was read already; `name` becomes the trial's file and stands in errors.
Result<Dataset> import_trial_text(std::string name, std::string text);

/// What makes the groups of an imported fabricslide set: what a split leaves out as a whole.
enum class FabricslideGroup {
  repetition,
  pressure,  ///< grip set-point, "120"
  speed      ///< "10", to and fro alike [mm/s]
};

/// Reads every `<Fabric>_F<grip>_V[-]<speed>mmps_<repetition>.csv` in `folder` whose name matches
/// `filter` (shell wildcards * and ?). Label = fabric, all phase M, 16 taxels.
Result<Dataset> import_fabricslide(const std::filesystem::path& folder,
                                   std::string_view filter = "*",
                                   FabricslideGroup group = FabricslideGroup::repetition);

/// What a sweep set beside each row of a feature table.
struct FactorColumns {
  std::vector<std::string> names;           ///< none: no sweep, no columns
  std::vector<std::vector<double>> values;  ///< [rows][names] SI
};
/// Of the trials that the rows are of, or of their windows; nothing where a row joins several.
FactorColumns factor_columns(const Dataset& dataset, const classifier::FeatureMatrix& features);

/// Writes `file,label,group`, the factors of a sweep and the features, a row a trial, with 17
/// significant digits so that every double comes back. A temporary name, renamed on success.
Status export_features_csv(const std::filesystem::path& path,
                           const classifier::FeatureMatrix& features,
                           const FactorColumns& factors = {});

}  // namespace weft::daemon
