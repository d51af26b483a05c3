#pragma once
// Vote aids as lines of a stored model.

#include <cstddef>
#include <optional>

#include "classifier/base/line_io.hpp"
#include "classifier/vote/postprocessing.hpp"

namespace weft::classifier {

/// One section; nothing is written as "aids 0".
void write_postprocessing(LineWriter& out, const std::optional<VotePostprocessing>& postprocessing);

/// The section back, bit for bit; `in` keeps the first problem. Sizes must fit the model's;
/// `sigmoids` is one per core, 0 for a learner without cores.
std::optional<VotePostprocessing> read_postprocessing(LineReader& in, std::size_t classes,
                                                      std::size_t features, std::size_t sigmoids);

}  // namespace weft::classifier
