#pragma once
// The digests of a data set, which may be given up: hours of recording take seconds.

#include "daemon/base/file/stop_asked.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// As digest_of(). `stop_asked` is looked at before each trial. Errors: wrong_state, when it was
/// stopped.
Result<DatasetDigest> digest_of(const Dataset& dataset, const StopAsked& stop_asked);

}  // namespace weft::daemon
