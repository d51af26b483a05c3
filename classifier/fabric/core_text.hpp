#pragma once
// One core as lines of a stored model, bit for bit.

#include <cstddef>
#include <string>
#include <string_view>

#include "classifier/fabric/core.hpp"
#include "classifier/fabric/line_text.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

void write_core(LineWriter& out, const FabricCore& core);
/// `in` keeps the first problem. `features`: length of a full feature vector.
FabricCore read_core(LineReader& in, std::size_t features);

/// The same as a text of its own: for cores that travel between processes. Errors: corrupt.
std::string core_text(const FabricCore& core);
Result<FabricCore> core_from_text(std::string_view text, std::size_t features);

}  // namespace weft::classifier
