#pragma once
// One recording under several names: where one copy trains, the other tests nothing.

#include <string>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Names of recordings with the same samples, two or more each, in the order of the first.
using Copies = std::vector<std::vector<std::string>>;

/// By what each holds, `contents` beside `names`: equal text for equal samples.
Copies copies_among(const std::vector<std::string>& names,
                    const std::vector<std::string>& contents);

/// Trials with the same counts and phases, whatever their times, labels and groups.
Copies copies_in(const Dataset& dataset);

/// A line for people; nothing where there are none.
std::string copies_text(const Copies& copies);

}  // namespace weft::daemon
