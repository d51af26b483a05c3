#pragma once
// Trials that come through a pipe.

#include <iosfwd>

#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

/// What trials from a pipe are called, in place of a file name.
inline constexpr const char* standard_input_name = "standard input";

/// Reads `in` to its end: a trial (CSV), or a whole data set, told by HDF5's signature. A data set
/// goes through a temporary file that is gone afterwards, because HDF5 needs to seek. Refuses no
/// stream, nothing in it, more than 4 GiB, and what readers of files refuse.
Result<Dataset> trials_from(std::istream* in);

}  // namespace weft::daemon::cli
