#pragma once
// The digests of a data set, which may be given up: hours of recording take seconds.

#include "daemon/base/file/stop_requested.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// As compute_digest(). `stop_requested` is looked at before each trial. Errors: wrong_state, when
/// it was stopped.
Result<DatasetDigest> compute_digest(const Dataset& dataset, const StopRequested& stop_requested);

}  // namespace weft::daemon
