#pragma once
// Effect of the plant's fidelity level on a classifier: trained at one level and tested at another,
// on the same piece of each fabric and across pieces. Also the shifts and rank changes of features
// from level to level. All data is synthetic: the results compare levels and do not show how well
// fabrics can be classified.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/features/trial.hpp"
#include "classifier/learners/learner.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::daemon {

// Trials like the paper's (rest, press, slide, rest), computed by the plant at a given level. All
// levels use the same trials: fabrics, places, spreads and noise have the same seeds.

/// How the plant of the trials is computed.
struct DownstreamLevel {
  std::string name;  ///< "L2 0.192 ms"
  sim::Level level = sim::Level::quasistatic;
  double step_s = 0;  ///< from L2 on
};

/// The trials made at each level.
struct DownstreamCampaign {
  std::size_t swatches = 2;  ///< pieces per fabric: different surfaces and waviness
  std::size_t trials = 8;    ///< per piece: spreads of the material, skew, noise
  double slide_s = 12.5;     ///< 25 mm at 2 mm/s
  std::size_t fabrics = 0;   ///< number of fabrics, from the start of the table; 0: all
};

/// The same trials measured by the 16 taxels, and by the force sensor (three channels, quantised to
/// its resolution, with noise of half a step). Groups are the pieces: "1", "2".
struct DownstreamTrials {
  std::vector<classifier::Trial> pads, force;
};

/// `seed` determines the rig and all random draws. Errors: those of cut_patch().
Result<DownstreamTrials> make_downstream_trials(const sim::FabricLibrary& library,
                                                const DownstreamCampaign& campaign,
                                                const DownstreamLevel& level, std::uint64_t seed);

struct DownstreamOptions {
  DownstreamCampaign campaign;
  std::size_t seeds = 5;  ///< at least 2: intervals are computed over seeds
  std::uint64_t first_seed = 1;
  std::vector<DownstreamLevel> levels;  ///< the last one is the reference; empty:
                                        ///< downstream_levels()
  std::vector<classifier::Learner> learners = {classifier::Learner::pvalue,
                                               classifier::Learner::lda, classifier::Learner::svc};
  classifier::TrainOptions training;
};

/// L0, L1, L2 at 1.024 and at 0.192 ms.
std::vector<DownstreamLevel> downstream_levels();

/// Mean over the seeds with Student's t interval. If all seeds have the same accuracy, Wilson's
/// interval of one seed.
struct SeedMean {
  double mean = 0;
  classifier::Interval ci95;
  std::vector<double> values;  ///< one value per seed
};

struct Transfer {
  std::string channels;  ///< "pads", "force"
  std::string learner;
  std::string trained, tested;  ///< levels
  bool across_swatches = false;
  SeedMean accuracy;
};

/// Features of one level compared with the reference level, over all trials of a seed.
struct FeatureShift {
  std::string channels;
  std::string level;
  SeedMean spearman;    ///< for the features' F statistics between fabrics
  SeedMean max_shift;   ///< largest shift in units of the feature's deviation within a fabric,
                        ///< averaged over fabrics; for the feature with the largest mean over the
                        ///< seeds
  std::string shifted;  ///< name of that feature
};

struct DownstreamResult {
  DownstreamCampaign campaign;
  std::size_t fabrics = 0, seeds = 0;
  std::vector<std::string> levels;
  std::vector<Transfer> transfers;
  std::vector<FeatureShift> shifts;
};

/// F of a one-way analysis of variance of every column over the labels; 0 for a column without
/// variance, infinity for one that varies only between labels.
std::vector<double> f_statistics(const classifier::FeatureMatrix& features);
/// Spearman's rank correlation with mean ranks for ties; 0 if a side is constant.
double spearman(std::span<const double> a, std::span<const double> b);
/// For every column: |difference of a label's means| divided by the pooled deviation within labels
/// of `yardstick`, averaged over the labels. 0 if neither varies.
std::vector<double> feature_shifts(const classifier::FeatureMatrix& features,
                                   const classifier::FeatureMatrix& yardstick);
/// Index of the feature with the largest mean shift over the seeds; on a tie, the first. Needs at
/// least one seed and one feature.
std::size_t most_shifted(std::span<const std::vector<double>> by_seed);

using DownstreamProgress = std::function<void(const std::string&)>;

/// Refuses fewer than two seeds, two trials or two pieces, and what training refuses.
Result<DownstreamResult> measure_downstream(const sim::FabricLibrary& library,
                                            DownstreamOptions options,
                                            const DownstreamProgress& progress = {});

}  // namespace weft::daemon
