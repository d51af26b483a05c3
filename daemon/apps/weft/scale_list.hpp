#pragma once
// Scales of smoothing as a command line gives them.

#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

/// "1,2,4" [taxels]. Errors: parse, for anything but numbers with commas between.
Result<std::vector<double>> scales_from(std::string_view text);

}  // namespace weft::daemon::cli
