#pragma once
// What lies where in the two files of a campaign.

#include <filesystem>
#include <vector>

#include "daemon/storage/certificate/file_checksums.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Tables and indices by runs of pages. Empty where this SQLite was built without dbstat.
std::vector<FileRegion> regions_of_campaign(const std::filesystem::path& campaign);
/// The stored chunks of the columns of samples with the trials whose rows they hold; other columns
/// by name. `dataset` is what was written. Empty where the file cannot be read.
std::vector<FileRegion> regions_of_dataset(const std::filesystem::path& file,
                                           const Dataset& dataset);

}  // namespace weft::daemon
