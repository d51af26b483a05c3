#pragma once
// What a campaign's simulation could have been: error of the force against the plant's speed, for
// the report of a simulated campaign. Source: the table of `weft trade sim` (sim/fidelity.json).

#include <string>
#include <string_view>

#include "sim/plant/fidelity/table.hpp"

namespace weft::daemon {

/// A section with a picture and the front as a table; `setting` ("L1 3.072 ms") is the campaign's,
/// and marked. Empty where the table has nothing of a campaign of many fabrics.
/// Errors: what pareto_front() refuses.
Result<std::string> fidelity_section_html(const sim::FidelityTable& table,
                                          std::string_view setting);

}  // namespace weft::daemon
