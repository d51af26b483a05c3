#pragma once
// One core as lines of a stored model, bit for bit.

#include <cstddef>
#include <string>
#include <string_view>

#include "classifier/base/line_io.hpp"
#include "classifier/fabric/core.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// The lines of a core.
std::string core_text(const FabricCore& core);
/// `in` keeps the first problem. `features`: length of a full feature vector.
FabricCore read_core(LineReader& in, std::size_t features);
/// Of such a text by itself: for cores that travel between processes. Errors: corrupt.
Result<FabricCore> core_from_text(std::string_view text, std::size_t features);

}  // namespace weft::classifier
