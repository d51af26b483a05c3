#pragma once
// The part of the page, of the data and of the text that is about trained classifiers.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/analysis/tradeoff/sim/downstream.hpp"

namespace weft::daemon {

/// A <section> with the tables.
std::string downstream_html(const DownstreamResult& result);
nlohmann::ordered_json downstream_json(const DownstreamResult& result);

}  // namespace weft::daemon
