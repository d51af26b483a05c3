#pragma once
// What every place where a device is served can do besides moving bytes.

#include "drivers/api/link.hpp"

namespace weft::daemon {

/// The device's end of a link, whose plug can be pulled.
class ServedPlace : public Link {
 public:
  /// Out: what a host sees when the plug is pulled. In: the same place again, for hosts to open
  /// anew. Nothing is done when it is so already. Errors: io, when the place cannot be had again.
  virtual Status set_plugged(bool in) = 0;
};

}  // namespace weft::daemon
