#pragma once
// The digest of a data set, computed from one trial after the other.

#include <cstdint>
#include <string>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Same digest as compute_digest(), which needs all trials in memory.
class DatasetHasher {
 public:
  /// `trials`: the number of trials to be added.
  DatasetHasher(const DatasetInfo& info, std::uint64_t trials);
  /// Returns the trial's own digest.
  std::string add(const classifier::Trial& trial, const TrialRecord& record);
  /// Call once, after the last trial.
  std::string finish();

 private:
  Sha256 hash_;
};

}  // namespace weft::daemon
