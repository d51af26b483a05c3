#pragma once
// What every place where a device is served can do besides moving bytes.

#include <functional>

#include "drivers/api/driver.hpp"

namespace weft::daemon {

/// The device's end of a link, whose plug can be pulled.
class ServedPlace : public Link {
 public:
  /// Out: what a host sees when the plug is pulled. In: the same place again, for hosts to open
  /// anew. Nothing is done when it is so already. Errors: io, when the place cannot be had again.
  virtual Status set_plugged(bool in) = 0;
  /// Called when another host has the place. On a datagram port hosts come and go unseen.
  virtual void on_new_host(std::function<void()>) {}
};

}  // namespace weft::daemon
