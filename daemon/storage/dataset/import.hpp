#pragma once
// Other people's recordings into a Dataset, and features out as text.

#include <filesystem>
#include <string>
#include <string_view>

#include "classifier/features/feature_matrix.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Reads a manifest (read_manifest(), kind trials) and each trial file it names, relative to the
/// manifest: `t_s,[phase,]ch1..chN`, no phase column means all M. Errors carry file:line.
/// `rate_hz`: as stated, or 0 for that of the times, which must then be regular (sample_times.hpp).
/// `bench`: as stated; else the manifest's, or unknown.
Result<Dataset> import_manifest(const std::filesystem::path& manifest, double rate_hz = 0,
                                std::optional<BenchKind> bench = {});

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
/// `filter` (shell wildcards * and ?). Label = fabric, all phase M, 16 taxels. `rate_hz` as above.
Result<Dataset> import_fabricslide(const std::filesystem::path& folder,
                                   std::string_view filter = "*",
                                   FabricslideGroup group = FabricslideGroup::repetition,
                                   double rate_hz = 0);

/// How the values of an icub20 slide make frames.
enum class Icub20Order {
  time,  ///< as the skin felt them
  filed  ///< rows as they stand in the table
};

/// Reads a table `sample,label,fold,t,tx1..txN` with a line for each step of each slide, the steps
/// of a slide together, t = 0, 1, 2, ..., in the order of time as many in each slide. Label and
/// group (the fold) as written, all phase M.
/// Nothing gives a rate: a step is taken as 0.02 s.
///
/// As published, a row of that table is no frame of the skin. Its values stand in groups of ten,
/// the taxels of one triangle of RoboSkin, and of a slide of J steps with I triangles a row the
/// group i of row j is, in the order of time, number J i + j: frames were once taken for I series
/// of J steps, and transposed. Neighbouring rows as filed have a correlation of -0.14, frames of
/// 0.97, the highest of all ways to take such a step back that were tried; labels had no part in
/// it.
Result<Dataset> import_icub20(const std::filesystem::path& path,
                              Icub20Order order = Icub20Order::time);

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

/// RFC 4180: in quotes where the text would break the line apart.
std::string csv_field(const std::string& text);

}  // namespace weft::daemon
