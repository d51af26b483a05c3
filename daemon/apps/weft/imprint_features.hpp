#pragma once
// Features of the imprints of a data set, as the command line requests them.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon::cli {

/// "1,2,4" [taxels]. Errors: parse for anything but numbers separated by commas.
Result<std::vector<double>> scales_from(std::string_view text);

/// How step edges are measured: the open points E2 and E3 of Ellis 1986.
struct EdgeChoice {
  std::string noise = "gradient";        ///< one of noise_names
  std::string orientation = "circular";  ///< one of orientation_names

  void apply_to(classifier::imprint::ScaleOptions& scales) const;
};
void add_edge_options(CLI::App& command, EdgeChoice& choice);

/// `scales`: "1,2,4" [taxels]. `kinds`: a sum such as "10+laws5" of one of form_names (Ellis 1986,
/// at every scale), laws3 and laws5 (Laws 1979), and maps (contact_maps() of the unsmoothed
/// imprint). Errors: parse for unknown words, and those of ScaleFeatures.
Result<classifier::imprint::FeaturePlan> feature_plan_from(const std::string& scales,
                                                           const std::string& kinds,
                                                           const EdgeChoice& edges = {});

/// The groups of `imprints`, which are the complete ones of `dataset`: the data set's groups, or
/// for recorded scans the objects.
std::vector<std::string> imprint_groups(const Dataset& dataset,
                                        std::span<const classifier::imprint::Imprint> imprints);

/// A row for every complete imprint; groups are imprint_groups(). Errors: those of build_matrix().
Result<classifier::FeatureMatrix> imprint_features(const Dataset& dataset,
                                                   const classifier::imprint::FeaturePlan& plan);

}  // namespace weft::daemon::cli
