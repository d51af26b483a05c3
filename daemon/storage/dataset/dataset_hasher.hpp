#pragma once
// The digest of a data set whose trials come one after the other.

#include <cstdint>
#include <string>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// As compute_digest(), which has all of them in memory.
class DatasetHasher {
 public:
  /// `trials`: how many will be added.
  DatasetHasher(const DatasetInfo& info, std::uint64_t trials);
  /// The trial's own digest.
  std::string add(const classifier::Trial& trial, const TrialRecord& record);
  /// Once, after the last.
  std::string finish();

 private:
  Sha256 hash_;
};

}  // namespace weft::daemon
