#pragma once
// What training has seen of the test windows, in words.

#include <string>

#include "classifier/vibro/protocol.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {

/// Of a leak whose largest share is above zero.
inline std::string leak_sentence(const classifier::vibro::Leak& leak) {
  return percent(leak.windows, 0) +
         " % of the test windows share samples with a training window, half of all at least " +
         percent(leak.median, 0) + " % of theirs, one " + percent(leak.largest, 0) + " %";
}

}  // namespace weft::daemon
