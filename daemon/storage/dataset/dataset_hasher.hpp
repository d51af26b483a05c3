#pragma once
// The digest of a data set, computed from one trial after the other.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Same digest as compute_digest(), which needs all trials in memory.
class DatasetHasher {
 public:
  /// Copies what it needs of `info`.
  explicit DatasetHasher(const DatasetInfo& info);
  /// Returns the trial's own digest.
  std::string add(const classifier::Trial& trial, const TrialRecord& record);
  /// Adds a trial by its digest, in hexadecimal; false if it is not one.
  bool add_digest(std::string_view hex);
  /// Call once, after the last trial.
  DatasetDigest finish();

 private:
  Sha256 hash_;
  std::vector<Sha256Digest> trials_;
};

}  // namespace weft::daemon
