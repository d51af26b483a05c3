#pragma once
// What a finished campaign says of campaigns to come, for its report.

#include <functional>
#include <string>

#include "daemon/analysis/report/report.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// So many repetitions make a learning curve of the report; fewer say too little.
inline constexpr std::size_t least_reported_repetitions = 6;

/// Of a sweep its analysis; of another campaign the learning curve of each exploration with enough
/// repetitions, foretold for twice as many. Nothing where neither is there, or where it cannot be
/// worked out: `progress` is then told why. Whole trials only: not for what a live vote has left.
DesignParts analyse_design(const Dataset& dataset,
                           const std::function<void(const std::string&)>& progress);

}  // namespace weft::daemon
