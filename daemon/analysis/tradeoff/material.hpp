#pragma once
// The trials of a data set, prepared in one way: features and seconds of sliding.

#include <optional>
#include <string>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/features/layout.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct MaterialOptions {
  std::string exploration;  ///< as in the data set; "M1+M2": the features of both side by side
  double slide_s = 0;       ///< only the first seconds of phase M; 0: all of it
  classifier::FeatureOptions features;
  std::size_t threads = 0;  ///< 0: one per core
};

/// What one answer is computed from: a trial, or one of each exploration that was joined.
using AnswerTrials = std::vector<classifier::Trial>;

struct Material {
  std::vector<std::vector<std::size_t>> trials;  ///< per row: numbers in the data set
  std::size_t most_samples = 0;                  ///< of phase M; 0: all
  classifier::FeatureMatrix features;
  std::vector<double> slide_s;  ///< per row: seconds of phase M that were used, of all its trials
  double longest_slide_s = 0;   ///< used of a single trial of a row
  std::vector<std::optional<double>> speed_mm_s;  ///< per row, where it is known
};

/// Complete trials only. A joined row is a label, group and repetition that has one complete trial
/// of each exploration, the last attempt where there were several. Refuses an exploration that is
/// not there, a data set whose sample rate is not known, and what the feature extraction refuses.
Result<Material> prepare(const Dataset& dataset, const MaterialOptions& options);

/// Copies of the trials of up to `count` of `rows`, spread evenly, cut as they were prepared.
std::vector<AnswerTrials> some_trials(const Dataset& dataset, const Material& material,
                                      const std::vector<std::size_t>& rows, std::size_t count);

/// `trial` with no more than the first `samples` samples of phase M; the other phases stay whole.
classifier::Trial shortened(const classifier::Trial& trial, std::size_t samples);

/// Speed of a recording named in the manner of fabricslide, "Denim_F120_V-10mmps_0.csv", without
/// its direction; nothing for other names. [mm/s]
std::optional<double> speed_in_name(const std::string& file);

}  // namespace weft::daemon
