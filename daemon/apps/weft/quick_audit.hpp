#pragma once
// The quick form of `weft audit`, for the report of a campaign.

#include <filesystem>
#include <vector>

#include "daemon/analysis/report/audit_headline.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon::cli {

/// Headlines of each exploration of `dataset`, which was read from `file`: 99 permutations with
/// LDA, none with trees, no changed features. If an audit fails, its headline gives the reason.
std::vector<AuditHeadline> audit_quickly(const std::filesystem::path& file, const Dataset& dataset);

}  // namespace weft::daemon::cli
