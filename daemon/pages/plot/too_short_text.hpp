#pragma once
// Recordings into which no window fits, in words.

#include <cstddef>
#include <string>
#include <vector>

#include "classifier/vibro/extract.hpp"

namespace weft::daemon {

/// "2 recordings are left out, as no window fits into them: a.wav (felt), b.wav (foil)".
std::string format_too_short(const std::vector<classifier::vibro::TooShort>& recordings,
                             std::size_t parts = 1);

}  // namespace weft::daemon
