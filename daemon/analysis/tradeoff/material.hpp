#pragma once
// The trials of a data set, prepared in one way: features, and duration of sliding.

#include <optional>
#include <string>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/features/layout.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct MaterialOptions {
  std::string exploration;  ///< name in the data set; "M1+M2": the features of both side by side
  double slide_s = 0;       ///< only the first seconds of phase M; 0: all
  classifier::FeatureOptions features;
  std::size_t threads = 0;  ///< 0: one per core
};

/// Input of one prediction: a trial, or one trial of each joined exploration.
using AnswerTrials = std::vector<classifier::Trial>;

struct Material {
  std::vector<std::vector<std::size_t>> trials;  ///< per row: indices in the data set
  std::size_t most_samples = 0;                  ///< in phase M; 0: all
  classifier::FeatureMatrix features;
  std::vector<double> slide_s;  ///< per row: used duration of phase M, summed over its trials
  double longest_slide_s = 0;   ///< longest used duration of a single trial
  std::vector<std::optional<double>> speed_mm_s;  ///< per row, if known
};

/// Uses complete trials only. A joined row is a label, group and repetition with one complete trial
/// of each exploration; of several attempts, the last. Refuses an exploration that does not exist,
/// a data set with an unknown sample rate, and everything that the feature extraction refuses.
Result<Material> prepare(const Dataset& dataset, const MaterialOptions& options);

/// Copies of the trials of up to `count` of `rows`, evenly spread, shortened as in preparation.
std::vector<AnswerTrials> some_trials(const Dataset& dataset, const Material& material,
                                      const std::vector<std::size_t>& rows, std::size_t count);

/// `trial` with at most the first `samples` samples of phase M; other phases are unchanged.
classifier::Trial shortened(const classifier::Trial& trial, std::size_t samples);

/// Speed in a fabricslide file name, "Denim_F120_V-10mmps_0.csv", without direction [mm/s]; nothing
/// for other names.
std::optional<double> speed_in_name(const std::string& file);

}  // namespace weft::daemon
