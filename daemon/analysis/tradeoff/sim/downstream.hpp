#pragma once
// What a classifier notices of the plant's level: trained at one and tested at another, on the same
// swatch of each cloth and across swatches; and how features move and re-rank from level to level.
// Synthetic on synthetic: the numbers compare levels, they do not say how well cloths are told
// apart.

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

// Trials of the paper's kind (rest, press, slide, rest) made of the plant at a given level. The
// same trials at every level: cloths, places, spreads and noise are drawn from the same seeds.

/// How the trials' plant is computed.
struct DownstreamLevel {
  std::string name;  ///< "L2 0.192 ms"
  sim::Level level = sim::Level::quasistatic;
  double step_s = 0;  ///< from L2 on
};

/// What is made at each level.
struct DownstreamCampaign {
  std::size_t swatches = 2;  ///< of each cloth: different surfaces and waviness
  std::size_t trials = 8;    ///< on each swatch: spreads of the material, skew, noise
  double slide_s = 12.5;     ///< 25 mm at 2 mm/s
  std::size_t fabrics = 0;   ///< the first so many of the table; 0: all
};

/// The same trials seen by the 16 pads and by the force sensor (three channels, in steps of its
/// resolution, with half a step of noise). Groups are swatches: "1", "2".
struct DownstreamTrials {
  std::vector<classifier::Trial> pads, force;
};

/// `seed` names the rig and all draws. Errors: what cut_patch() refuses.
Result<DownstreamTrials> make_downstream_trials(const sim::FabricLibrary& library,
                                                const DownstreamCampaign& campaign,
                                                const DownstreamLevel& level, std::uint64_t seed);

struct DownstreamOptions {
  DownstreamCampaign campaign;
  std::size_t seeds = 5;  ///< at least 2: intervals are over them
  std::uint64_t first_seed = 1;
  std::vector<DownstreamLevel> levels;  ///< the last one is the yardstick; empty: the usual four
  std::vector<classifier::Learner> learners = {classifier::Learner::pvalue,
                                               classifier::Learner::lda, classifier::Learner::svc};
  classifier::TrainOptions training;
};

/// L0, L1, L2 at 1.024 and at 0.192 ms.
std::vector<DownstreamLevel> downstream_levels();

/// Mean over the seeds, with Student's t; of accuracies that are the same with every seed, with
/// Wilson's interval of one.
struct SeedMean {
  double mean = 0;
  classifier::Interval ci95;
  std::vector<double> values;  ///< one per seed
};

struct Transfer {
  std::string channels;  ///< "pads", "force"
  std::string learner;
  std::string trained, tested;  ///< levels
  bool across_swatches = false;
  SeedMean accuracy;
};

/// Features of one level beside those of the yardstick, all trials of a seed.
struct FeatureShift {
  std::string channels;
  std::string level;
  SeedMean spearman;    ///< of the features' F statistics between cloths
  SeedMean max_shift;   ///< of the feature that moves most in the mean over the seeds: mean over
                        ///< cloths of its shift, in its deviation within a cloth
  std::string shifted;  ///< which feature that is
};

struct DownstreamResult {
  DownstreamCampaign campaign;
  std::size_t fabrics = 0, seeds = 0;
  std::vector<std::string> levels;
  std::vector<Transfer> transfers;
  std::vector<FeatureShift> shifts;
};

/// F of a one-way analysis of variance of every column over the labels; 0 for a column without any
/// variance, infinity for one that varies between labels alone.
std::vector<double> f_statistics(const classifier::FeatureMatrix& features);
/// Spearman's rank correlation with mean ranks for ties; 0 where a side is constant.
double spearman(std::span<const double> a, std::span<const double> b);
/// Of every column: mean over the labels of |difference of the label's means| by the pooled
/// deviation within labels of `yardstick`. 0 where neither varies.
std::vector<double> feature_shifts(const classifier::FeatureMatrix& features,
                                   const classifier::FeatureMatrix& yardstick);
/// Of the shifts of every feature, seed by seed, the feature with the largest mean; the first of
/// equals. There must be one of both.
std::size_t most_shifted(std::span<const std::vector<double>> by_seed);

using DownstreamProgress = std::function<void(const std::string&)>;

/// Refuses fewer than two seeds, two trials or two swatches, and what training refuses.
Result<DownstreamResult> measure_downstream(const sim::FabricLibrary& library,
                                            DownstreamOptions options,
                                            const DownstreamProgress& progress = {});

}  // namespace weft::daemon
