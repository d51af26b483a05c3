#pragma once
// The digests of a data set, which may be given up: hours of recording take seconds.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/base/file/stop_requested.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

// One recording under several names: where one copy trains, the other tests nothing.

/// Names of recordings with the same samples, two or more each, in the order of the first.
using Copies = std::vector<std::vector<std::string>>;

/// By what each holds, `contents` beside `names`: equal text for equal samples.
Copies copies_among(const std::vector<std::string>& names,
                    const std::vector<std::string>& contents);

/// Trials with the same counts and phases, whatever their times, labels and groups.
Copies copies_in(const Dataset& dataset);

/// A line for people; nothing where there are none.
std::string copies_text(const Copies& copies);

/// The same values as 16-bit counts, or nothing when one of them is not a whole number from 0 to
/// 65535.
std::optional<std::vector<std::uint16_t>> as_u16(std::span<const double> counts);

/// As compute_digest(). `stop_requested` is looked at before each trial. Errors: wrong_state, when
/// it was stopped.
Result<DatasetDigest> compute_digest(const Dataset& dataset, const StopRequested& stop_requested);

}  // namespace weft::daemon
