#pragma once
// Where a stored model comes from.

#include <string>

namespace weft::classifier {

/// Where a model comes from.
struct Provenance {
  std::string bench = "unknown";  ///< "simulated", "real" or "unknown"
  std::string dataset_sha256;
  std::string software_version;
  std::string training;  ///< options of the training, for people
};

}  // namespace weft::classifier
