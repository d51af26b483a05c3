#pragma once
// `weft evaluate --importance`: which features of sound and vibration a learner leans on.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "classifier/vibro/importance.hpp"

namespace weft::daemon::cli {

/// How many features the paper kept of its ten.
inline constexpr std::size_t features_selected = 5;

/// Weighs the columns of `windows` on the splits, and adds to `json` and the text it gives back
/// what came out: permutation of test windows by `options.method`, and a forest of training
/// windows. Then what the learner reaches with the columns that the same permutation selects on the
/// training windows of each split, parted as `protocol` says, beside the paper's five and all.
/// Errors: weigh_features()'s and reach_by_selection()'s.
Result<std::string> add_importance(const classifier::vibro::WindowSet& windows,
                                   std::span<const classifier::Split> splits,
                                   classifier::vibro::Protocol protocol,
                                   const classifier::vibro::PipelineOptions& options,
                                   std::size_t repeats, nlohmann::json& json);

}  // namespace weft::daemon::cli
