#pragma once
// Digests of the rows of a campaign file that no CRC covers.

#include <string>
#include <vector>

#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon {

/// Tables without a trial of their own: campaign, axis, device, journal.
Result<std::vector<CertifiedTable>> table_digests(sqlite::Database& campaign);

/// One attempt as the file has it, without its samples.
struct CataloguedTrial {
  std::int64_t id = 0;  ///< of its row
  std::string sha256;   ///< of its row and of its chunks' rows
  std::vector<CertifiedGap> gaps;
};
/// In plan order, as load_campaign() gives them.
Result<std::vector<CataloguedTrial>> catalogued_trials(sqlite::Database& campaign);

}  // namespace weft::daemon
