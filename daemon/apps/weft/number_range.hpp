#pragma once
// The range of an option that takes a number.

namespace CLI {
class Validator;
}

namespace weft::daemon::cli {

/// CLI::Range of a fraction, but "nan" is refused too: it is neither below nor above anything.
CLI::Validator number_range(double least, double most);

}  // namespace weft::daemon::cli
