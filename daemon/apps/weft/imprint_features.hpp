#pragma once
// Features of the imprints of a data set, as a command line asks for them.

#include <span>
#include <string>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon::cli {

/// `scales`: "1,2,4" [taxels]. `kinds`: a sum of 10 or 7 (Ellis 1986, at every scale), laws3 and
/// laws5 (Laws 1979, on the imprint as it is), such as "10+laws5". Errors: parse for words that
/// mean nothing, and those of ScaleFeatures.
Result<classifier::imprint::FeaturePlan> feature_plan_from(const std::string& scales,
                                                           const std::string& kinds);

/// The groups of `imprints`, which are the complete ones of `dataset`: those of the data set, of
/// recorded scans the objects.
std::vector<std::string> imprint_groups(const Dataset& dataset,
                                        std::span<const classifier::imprint::Imprint> imprints);

/// A row for every complete imprint; groups are imprint_groups(). Errors: those of build_matrix().
Result<classifier::FeatureMatrix> imprint_features(const Dataset& dataset,
                                                   const classifier::imprint::FeaturePlan& plan);

/// Mean time of one imprint's features, over the first 16, on one thread [s]; 0 where they cannot
/// be extracted.
double seconds_of_imprint_features(const Dataset& dataset,
                                   const classifier::imprint::FeaturePlan& plan,
                                   const classifier::SecondsNow& seconds_now);

}  // namespace weft::daemon::cli
