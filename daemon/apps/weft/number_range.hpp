#pragma once
// The range of an option that takes a number.

#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace CLI {
class Validator;
}

namespace weft::daemon::cli {

/// "1,2,4" [taxels]. Errors: parse, for anything but numbers with commas between.
Result<std::vector<double>> scales_from(std::string_view text);

/// CLI::Range of a fraction, but "nan" is refused too: it is neither below nor above anything.
CLI::Validator number_range(double least, double most);

}  // namespace weft::daemon::cli
