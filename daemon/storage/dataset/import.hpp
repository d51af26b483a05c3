#pragma once
// Imports third-party recordings into a Dataset, and exports features as text.

#include <filesystem>
#include <string>
#include <string_view>

#include "classifier/features/feature_matrix.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Reads a manifest (read_manifest(), kind trials) and each trial file in it, relative to the
/// manifest: `t_s,[phase,]ch1..chN`; without a phase column all samples are phase M. Errors carry
/// file:line. `rate_hz`: the stated rate; 0: the rate of the times, which must then be regular
/// (sample_times.hpp). `bench`: as stated; otherwise the manifest's, or unknown.
Result<Dataset> import_manifest(const std::filesystem::path& manifest, double rate_hz = 0,
                                std::optional<BenchKind> bench = {});

/// One such trial file: a data set of one trial without label or group.
Result<Dataset> import_trial(const std::filesystem::path& path);
/// The same from text in memory; `name` becomes the trial's file and appears in errors.
Result<Dataset> import_trial_text(std::string name, std::string text);

/// Group of an imported fabricslide trial, which a split leaves out as a whole.
enum class FabricslideGroup {
  repetition,
  pressure,  ///< grip set point, "120"
  speed      ///< "10", equal for both directions [mm/s]
};

/// Reads every `<Fabric>_F<grip>_V[-]<speed>mmps_<repetition>.csv` in `folder` with a name that
/// matches `filter` (shell wildcards * and ?). Label: the fabric; all phase M; 16 taxels.
/// `rate_hz`: see import_manifest().
Result<Dataset> import_fabricslide(const std::filesystem::path& folder,
                                   std::string_view filter = "*",
                                   FabricslideGroup group = FabricslideGroup::repetition,
                                   double rate_hz = 0);

/// How the values of an icub20 slide form frames.
enum class Icub20Order {
  time,  ///< in the order of measurement
  filed  ///< one row of the table is one frame
};

/// Reads a table `sample,label,fold,t,tx1..txN` with one line per step of each slide. The steps of
/// a slide are contiguous, t = 0, 1, 2, ...; in order of time, all slides have the same number of
/// steps. Label and group (the fold) as written, all phase M. The set states no rate: a step counts
/// as 0.02 s.
///
/// In the published table a row is not a frame of the skin. Its values form groups of ten, the
/// taxels of one RoboSkin triangle. For a slide of J steps with I triangles per row, group i of row
/// j has the number J i + j in order of time. The frames were once treated as I series of J steps
/// and transposed. Neighbouring rows have a correlation of -0.14 as filed, and of 0.97 as frames.
/// This is the highest of all inverse reorderings that were tried; labels were not used.
Result<Dataset> import_icub20(const std::filesystem::path& path,
                              Icub20Order order = Icub20Order::time);

/// The factor values of a sweep beside each row of a feature table.
struct FactorColumns {
  std::vector<std::string> names;           ///< empty: no sweep, no columns
  std::vector<std::vector<double>> values;  ///< [rows][names] SI
};
/// For the trials of the rows, or of their windows; empty if a row joins several trials.
FactorColumns factor_columns(const Dataset& dataset, const classifier::FeatureMatrix& features);

/// Writes `file,label,group`, the factors of a sweep and the features, one row per trial. With 17
/// significant digits, every double is restored exactly. Written under a temporary name and renamed
/// on success.
Status export_features_csv(const std::filesystem::path& path,
                           const classifier::FeatureMatrix& features,
                           const FactorColumns& factors = {});

/// RFC 4180: quoted if the text contains characters that would break the line.
std::string csv_field(const std::string& text);

}  // namespace weft::daemon
